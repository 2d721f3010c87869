// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/foam.h"
#include "foam/optim/optimizer.h"
#include "foam/util/host_device.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// How a foam changes at a densification: which old site each new one comes from.
struct Rearrangement {
  std::vector<uint32_t> origin;            // [new N] index of the old site
  std::vector<uint8_t> is_new;             // [new N] 1 = a child of it, at a place of its own
  std::vector<Eigen::Vector3f> positions;  // [new N] as of the plan
  size_t num_pruned = 0;
  size_t num_added = 0;
};

struct DensificationOptions {
  size_t num_to_add = 0;  // children, at most
  float prune_contribution =
      1e-2f;  // a cell that, with all its neighbours, never weighs more than this is pruned ...
  float prune_radius =
      0.02f;  // ... if its radius is smaller; large empty cells hold the space open
  float transparent_contribution =
      1e-3f;                       // a cell that never weighs more than this becomes transparent
  float seen_contribution = 0.1f;  // children are placed towards neighbours that weigh as much
};

// The raw density with which a cell of this largest rendering weight goes into a densification.
SEMFOAM_HOST_DEVICE inline float FadedRawDensity(float raw,
                                                 float contribution,
                                                 float transparent_contribution) {
  return contribution < transparent_contribution && kLowestRawDensity < raw ? kLowestRawDensity
                                                                            : raw;
}

// Plans to prune what nothing sees, and to add children to cells drawn without replacement with
// probability proportional to the squared error of the colours that they had a part in: where a
// photo has more detail than the cells can show. (Radiant Foam takes |dL/dposition| times the
// cell's radius, which cancels inside a cell that shows a fine pattern; foam/NOTES.md has the
// comparison.) A child lies a quarter of the way to the parent's farthest neighbour that is seen,
// or farthest neighbour at all, jittered, and copies everything else from its parent. The new order
// is that of Hilbert. Random numbers are keyed by (seed, event).
Rearrangement PlanDensification(const Delaunay& delaunay,
                                const DensificationStatistics& statistics,
                                const DensificationOptions& options,
                                uint64_t seed,
                                uint64_t event,
                                const Foam& foam);

// Carries the plan out, at once or later: what the foam has learned in between is kept, and old
// sites stay where they are now.
void Rearrange(const Rearrangement& plan,
               const DensificationStatistics& statistics,
               const DensificationOptions& options,
               Foam* foam);

}  // namespace semfoam
