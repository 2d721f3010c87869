// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/model/foam.h"
#include "foam/optim/optimizer.h"
#include "foam/train/drawn_squares.h"
#include "foam/view/view_renderer.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

// Cuts space into blocks whose sites can be trained apart from each other.

namespace semfoam {

// An axis-aligned box in the normalised frame, half-open: low <= x < high.
struct BlockBox {
  Eigen::Vector3f low = Eigen::Vector3f::Constant(-std::numeric_limits<float>::infinity());
  Eigen::Vector3f high = Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity());

  bool Contains(const Eigen::Vector3f& x) const {
    return (x.array() >= low.array()).all() && (x.array() < high.array()).all();
  }
  // Returns the box with all its faces moved outwards by `width`.
  BlockBox Padded(float width) const {
    return {(low.array() - width).matrix(), (high.array() + width).matrix()};
  }
  // Returns whether the two boxes have points in common.
  bool Meets(const BlockBox& other) const {
    return (low.array() < other.high.array()).all() && (other.low.array() < high.array()).all();
  }
  // Returns whether a ray meets the box nearer than `distance`.
  bool IsMetBefore(const Eigen::Vector3f& origin,
                   const Eigen::Vector3f& direction,
                   float distance) const;
};

// Returns the number of sites that each site is expected to become, [N]: densification spreads the
// sites up to `final_sites` by the squared errors, or evenly where there are none yet.
std::vector<double> ExpectedSites(const DensificationStatistics& statistics, int64_t final_sites);

// Cuts space into columns x rows boxes of about the same sum of `weights` [N]: into `columns` slabs
// across the axis along which the sites spread farthest, and each slab into `rows` across the axis
// along which they spread second farthest. The boxes have no gaps; the outer ones are unbounded.
// Returns [columns * rows], slab by slab.
std::vector<BlockBox> SplitSpace(const std::vector<Eigen::Vector3f>& sites,
                                 const std::vector<double>& weights,
                                 int columns,
                                 int rows);

// Returns how far the weights spread along the two axes that SplitSpace cuts, the larger first: the
// distances in which the middle eight tenths of them lie.
std::array<double, 2> SpreadOfSites(const std::vector<Eigen::Vector3f>& sites,
                                    const std::vector<double>& weights);

// Returns the width of the halo around a block: sites there are trained with the block and belong
// to its neighbours. Some layers of the cells that `statistics` have seen or, where they have seen
// none, of the solid ones; 0 where there are none. `radii` [N].
float HaloWidth(const Foam& foam,
                const std::vector<float>& radii,
                const DensificationStatistics& statistics);

// The rays of one block.
struct BlockRays {
  DrawnSquares squares;
  // Views that show a part of the block, ascending.
  std::vector<int> views;
  // Share of all squares of the views that are not held out.
  double share = 0;
  // [N] 1: a ray passes through the site's cell, or ends there.
  std::vector<uint8_t> is_met;
};

// Chooses the rays of each block by what a foam of the whole scene shows: all that end in the block
// or its halo, and of those that pass through the block and end elsewhere, those beside the former
// and one in eight of the others, which keep its empty space empty. Views of which a block takes
// less than 2 % have none there. A foam without the cells that no ray meets shows the same: where a
// cell goes, its neighbours' faces only become larger.
std::vector<BlockRays> ChooseRays(const TrainingViews& views,
                                  const ViewRenderer& renderer,
                                  const std::vector<BlockBox>& boxes,
                                  float halo);

}  // namespace semfoam
