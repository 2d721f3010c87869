// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/cell_labels.h"

#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/model/activation.h"
#include "foam/model/classifier.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>

namespace semfoam {

CellLabels LabelCells(const Foam& foam, const Delaunay& delaunay, float solid_optical_depth) {
  const size_t n = foam.NumSites();
  CellLabels labels;
  labels.class_index.assign(n, kUnlabelled);
  labels.confidence.assign(n, 0.f);
  labels.solid.assign(n, 0);
  const std::vector<float> radii = CellRadii(WithGuardSites(foam.positions), delaunay);
  ParallelForBlocks(n, 1024, [&](int64_t begin, int64_t end) {
    std::vector<float> logits(foam.num_classes);
    for (int64_t i = begin; i < end; ++i) {
      labels.solid[i] = Density(foam.raw_density[i]) * radii[i] >= solid_optical_depth &&
                        !IsSkySite(foam.positions[i]);
      if (!foam.HasSemantics()) continue;
      ClassLogits(foam, &foam.identity[i * kIdentityDim], logits.data());
      const MostLikelyClass best = ArgmaxSoftmax(logits);
      labels.class_index[i] = ClassIndex{best.class_index};
      labels.confidence[i] = best.confidence;
    }
  });
  return labels;
}

}  // namespace semfoam
