// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/util/host_device.h"

#include <cmath>
#include <cstdint>

#include <Eigen/Core>

namespace semfoam {

// Variation of the colours over the Voronoi graph. Where two opaque cells touch, they show parts of
// one surface, whose colour seldom changes just there: without this term each cell fits the noise
// of the few photos that see it, and new views show facets.
//   L = mean over the edges (i, j) between real cells of a_ij o_i o_j sum over channels of h(d),
//   d = colour of i less that of j, both at the midpoint of their sites, which lies on the plane of
//       their face; colours are display values, of SH degree 0 and the colour gradient,
//   h(d) = |d| - k / 2 where |d| >= k, else d^2 / (2 k), k = kColorKnee (Huber 1964, over k),
//   o = opacity across a cell (CellOpacity), a_ij as in total_variation.h.
// No gradient flows into areas, opacities and positions. Total variation of this kind in a grid:
// Plenoxels (Fridovich-Keil et al. 2022), section 3.4.

// Differences of display values below this count by their square.
inline constexpr double kColorKnee = 0.02;

// Cells less opaque than this are empty: their edges do not count.
inline constexpr double kLeastOpacity = 0.05;

// Number of derivatives of a cell: kColorGradientDim by its colour gradient, then three by its SH
// coefficients of degree 0, as in a ParameterRow.
inline constexpr int kColorVariationDim = kColorGradientDim + 3;

// What an edge reads of a cell, a row of kSurfaceColorDim numbers: its colour gradient
// [kColorGradientDim], the display values at its site [3], its site [3] and its opacity. The size
// of an identity, and a cache line.
inline constexpr int kSurfaceColorDim = 16;
inline constexpr int kColorAt = kColorGradientDim, kSiteAt = kColorAt + 3, kOpacityAt = kSiteAt + 3;
static_assert(kOpacityAt + 1 == kSurfaceColorDim && kSurfaceColorDim == kIdentityDim);

// Returns the opacity across a cell of this density and radius; 0 where it counts as empty.
SEMFOAM_HOST_DEVICE inline float CellOpacity(float density, float radius) {
  const float opacity = 1 - std::exp(-2 * radius * density);
  return opacity < static_cast<float>(kLeastOpacity) ? 0.f : opacity;
}

// Writes a cell's row. `sh` are its coefficients; `color_gradient` is [kColorGradientDim], or null
// for a cell of one colour.
SEMFOAM_HOST_DEVICE inline void WriteSurfaceColor(const Eigen::Vector3f& site,
                                                  float opacity,
                                                  const float* sh,
                                                  const float* color_gradient,
                                                  float* row) {
  for (int k = 0; k < kColorGradientDim; ++k) {
    row[k] = color_gradient != nullptr ? color_gradient[k] : 0.f;
  }
  for (int k = 0; k < 3; ++k) {
    row[kColorAt + k] = 0.5f + static_cast<float>(kShDc) * sh[k];
    row[kSiteAt + k] = site[k];
  }
  row[kOpacityAt] = opacity;
}

// The Voronoi graph with the weights of TotalVariationWeights, and the rows of its cells. Borrowed.
struct ColorGraph {
  const uint32_t* offsets = nullptr;  // null: no variation in this step
  const uint32_t* neighbors = nullptr;
  const float* weights = nullptr;
  uint32_t num_sites = 0;
  const float* rows = nullptr;  // [num_sites][kSurfaceColorDim]
  // Weight of the term, times kIdentityDim, which TotalVariationWeights are divided by.
  float scale = 0;
};

// Returns the derivative of h.
template <typename T>
SEMFOAM_HOST_DEVICE T ColorSlope(const T& difference) {
  const T scaled = difference / T(kColorKnee);
  return scaled < T(-1) ? T(-1) : scaled > T(1) ? T(1) : scaled;
}

// Returns the difference d of an edge in a channel, of the rows of its cells.
template <typename T>
SEMFOAM_HOST_DEVICE T ColorDifference(const T* i, const T* j, int channel) {
  T difference = i[kColorAt + channel] - j[kColorAt + channel];
  for (int a = 0; a < 3; ++a) {
    const T half = T(0.5) * (j[kSiteAt + a] - i[kSiteAt + a]);
    difference += half * (i[3 * a + channel] + j[3 * a + channel]);
  }
  return difference;
}

// Returns one edge's share of L: weight o_i o_j times the sum over channels of h(d).
template <typename T>
SEMFOAM_HOST_DEVICE T ColorEdgeVariation(const T& weight, const T* i, const T* j) {
  T sum = T(0);
  for (int c = 0; c < 3; ++c) {
    const T d = ColorDifference(i, j, c), slope = ColorSlope(d);
    sum += slope * d - T(0.5 * kColorKnee) * slope * slope;
  }
  return weight * i[kOpacityAt] * j[kOpacityAt] * sum;
}

// Adds the derivatives of ColorEdgeVariation by the parameters of cell i to `gradient`
// [kColorVariationDim].
template <typename T>
SEMFOAM_HOST_DEVICE void AddColorSlopes(const T& weight, const T* i, const T* j, T* gradient) {
  for (int c = 0; c < 3; ++c) {
    const T slope = weight * i[kOpacityAt] * j[kOpacityAt] * ColorSlope(ColorDifference(i, j, c));
    for (int a = 0; a < 3; ++a) {
      gradient[3 * a + c] += T(0.5) * (j[kSiteAt + a] - i[kSiteAt + a]) * slope;
    }
    gradient[kColorGradientDim + c] += T(kShDc) * slope;
  }
}

}  // namespace semfoam
