// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/foam.h"
#include "foam/util/host_device.h"

#include <cmath>
#include <span>
#include <type_traits>
#include <vector>

namespace semfoam {

// Total variation of the identity features over the Voronoi graph (Semantic Foam, section 3), in a
// form free of the scene's scale:
//   L = mean over the edges (i, j) between real cells, and over channels, of a_ij |f_i - f_j|,
//   a_ij = face area / mean face area of the two cells, clamped to [0.1, 10].
// No gradient flows into the areas. The published code clamps the absolute area at 1 from below,
// which makes every weight 1 at usual scales.

// Computes a_ij / (number of edges * channels) for every directed edge, aligned with
// delaunay.neighbors; 0 towards guards.
std::vector<float> TotalVariationWeights(const Delaunay& delaunay,
                                         const std::vector<double>& face_areas);

// Computes one edge's share of L: weight * sum over channels of |f_i - f_j|.
template <typename T>
SEMFOAM_HOST_DEVICE T EdgeVariation(const T& weight, const T* f_i, const T* f_j) {
  using std::abs;
  T sum = T(0);
  for (int c = 0; c < kIdentityDim; ++c) sum += abs(f_i[c] - f_j[c]);
  return weight * sum;
}

// Writes dL/df, times `scale`, to `gradient` [num_sites][kIdentityDim], and returns L. At the kink
// f_i = f_j a channel's derivative is 0.
template <typename Real>
double TotalVariation(const Delaunay& delaunay,
                      const std::vector<Real>& weights,
                      std::span<const std::type_identity_t<Real>> identity,
                      Real scale,
                      std::vector<Real>* gradient);

extern template double TotalVariation(
    const Delaunay&, const std::vector<float>&, std::span<const float>, float, std::vector<float>*);
extern template double TotalVariation(const Delaunay&,
                                      const std::vector<double>&,
                                      std::span<const double>,
                                      double,
                                      std::vector<double>*);

}  // namespace semfoam
