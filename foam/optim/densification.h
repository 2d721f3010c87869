// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/model/foam.h"
#include "foam/optim/optimizer.h"
#include "foam/util/host_device.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// The changes of a foam at a densification: the old site that each new one comes from.
struct Rearrangement {
  // [new N] Index of the old site.
  std::vector<uint32_t> origin;
  // [new N] 1 for a child of the old site, with a position of its own; 0 for the old site itself.
  std::vector<uint8_t> is_new;
  // [new N] Positions at the time of the plan.
  std::vector<Eigen::Vector3f> positions;
  size_t num_pruned = 0;
  size_t num_added = 0;
};

struct DensificationOptions {
  // Maximum number of children.
  size_t num_to_add = 0;
  // A cell is pruned if neither it nor any neighbour ever weighs more than `prune_contribution` and
  // its radius is below `prune_radius`: large empty cells stay, because they keep empty space
  // empty.
  float prune_contribution = 1e-2f;
  float prune_radius = 0.02f;
  // A cell that never weighs more than this is made transparent.
  float transparent_contribution = 1e-3f;
  // Children are placed towards neighbours that weigh at least this much.
  float seen_contribution = 0.1f;
};

// Returns the raw density with which a cell of this largest rendering weight enters a
// densification: lowered to kLowestRawDensity if the weight is below `transparent_contribution` and
// the cell is not sky, in which there would be holes.
SEMFOAM_HOST_DEVICE inline float FadedRawDensity(float raw,
                                                 const Eigen::Vector3f& position,
                                                 float contribution,
                                                 float transparent_contribution) {
  const bool fades = contribution < transparent_contribution && !IsSkySite(position);
  return fades && kLowestRawDensity < raw ? kLowestRawDensity : raw;
}

// Plans a densification. Prunes cells that no ray sees, and adds children to cells drawn without
// replacement, with probability proportional to the squared error of the colours that they
// contributed to: where a photo has more detail than the cells can show. (Radiant Foam takes
// |dL/dposition| times the cell's radius, which cancels inside a cell that shows a fine pattern;
// foam/NOTES.md has the comparison.) A child lies a quarter of the way to the parent's farthest
// visible neighbour (without any, the farthest neighbour), jittered, and copies all other
// parameters of its parent. Children of sky are on the way to other sky, as far out as their
// parents: nearer, one would hide all that is behind. The new sites are in Hilbert order. Random
// numbers are keyed by (seed, event).
Rearrangement PlanDensification(const Delaunay& delaunay,
                                const DensificationStatistics& statistics,
                                const DensificationOptions& options,
                                uint64_t seed,
                                uint64_t event,
                                const Foam& foam);

// Executes a plan, at once or later: parameters learned since the plan are kept, and old sites keep
// their current positions.
void Rearrange(const Rearrangement& plan,
               const DensificationStatistics& statistics,
               const DensificationOptions& options,
               Foam* foam);

}  // namespace semfoam
