// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/train/space_blocks.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

// Chooses the sites with which the training of a block begins.

namespace semfoam {

struct StartSites {
  // [N] The site of the foam that was split; of a new one, the site nearest to it.
  std::vector<uint32_t> origin;
  // [N] 1: the site keeps what the split has trained.
  std::vector<uint8_t> is_frozen;
  // [N] 1: the site is none of the split, but the next of `points`.
  std::vector<uint8_t> is_new;
  std::vector<SeedPoint> points;

  size_t NumFrozen() const;
};

// Returns the sites in the padded box, which are trained, and of those around it the ones that rays
// of the block meet, `is_met` [positions], which are frozen; in their order.
StartSites ChooseStartSites(std::span<const Eigen::Vector3f> positions,
                            const BlockBox& padded,
                            const std::vector<uint8_t>& is_met);

// Adds sites at seeds in the padded box, thinned by voxels (ThinPoints), until there are `most`
// that are trained, each after the site that is nearest to it. Adds none where no site is trained.
void AddSitesAtSeeds(const std::vector<SeedPoint>& seeds,
                     std::span<const Eigen::Vector3f> positions,
                     const BlockBox& padded,
                     int64_t most,
                     StartSites* sites);

}  // namespace semfoam
