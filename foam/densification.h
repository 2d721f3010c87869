// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/delaunay.h"
#include "foam/foam.h"
#include "foam/optimizer.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// How a foam changes at a densification: which old site each new one comes from.
struct Rearrangement {
  std::vector<uint32_t> origin;  // [new N] index of the old site
  std::vector<uint8_t> is_new;   // [new N] 1 = a child of it, at a place of its own
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
      1e-3f;  // a cell that never weighs more than this becomes transparent
};

// Prunes what nothing sees, and adds children to cells drawn without replacement with probability
// proportional to error * cell radius (Radiant Foam, section on adaptive densification). A child
// lies a quarter of the way to the parent's farthest neighbour, jittered, and copies everything
// else from its parent. The foam comes back in Hilbert order. Random numbers are keyed by (seed,
// event).
Rearrangement Densify(const Delaunay& delaunay,
                      const DensificationStatistics& statistics,
                      const DensificationOptions& options,
                      uint64_t seed,
                      uint64_t event,
                      Foam* foam);

}  // namespace semfoam
