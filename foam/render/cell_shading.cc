// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/render/cell_shading.h"

#include "foam/geometry/guard_sites.h"
#include "foam/model/activation.h"
#include "foam/util/parallel.h"

#include <algorithm>

namespace semfoam {

float ShownDensity(const Foam& foam, size_t site) {
  const float trained = Density(foam.raw_density[site]);
  return foam.assumed_density.empty() ? trained : std::max(trained, foam.assumed_density[site]);
}

std::vector<float> CellDensities(const Foam& foam) {
  std::vector<float> density(foam.NumSites() + kNumGuardSites, 0.f);
  ParallelForBlocks(foam.NumSites(), 4096, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) density[i] = ShownDensity(foam, i);
  });
  return density;
}

}  // namespace semfoam
