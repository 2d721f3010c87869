// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/host_device.h"
#include "foam/util/large_pages.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Length of a cell's identity feature (Semantic Foam, section 3).
inline constexpr int kIdentityDim = 16;

// Length of a cell's colour gradient: three channels along three axes.
inline constexpr int kColorGradientDim = 9;

SEMFOAM_HOST_DEVICE inline constexpr int NumShCoefficients(int sh_degree) {
  return (sh_degree + 1) * (sh_degree + 1);
}

// The foam: N sites whose Voronoi cells partition space. Holds all parameters of training, and what
// is assumed. Positions are in the normalised frame (see Similarity); structure of arrays, sites in
// Hilbert order. The guard sites (foam/geometry/guard_sites.h) are not part of it.
struct Foam {
  // Degree of the spherical harmonics, 0..3.
  int sh_degree = 0;
  // Number of classes K; 0: no semantics, and `identity` and the classifier are empty.
  int num_classes = 0;

  // [N] Positions of the sites.
  std::vector<Eigen::Vector3f> positions;
  // [N] Densities before the activation (activation.h).
  std::vector<float> raw_density;
  // [N] or empty. Density, after the activation, that views show at least of a cell that no
  // training photo sees (foam/train/hidden_cells.h); 0: none. Labels, objects and exports of
  // geometry do not count it: nothing is known there.
  std::vector<float> assumed_density;
  // [N][(sh_degree + 1)^2][3] SH coefficients: coefficient-major, channels interleaved.
  LargePageVector<float> sh;
  // [N][3 axes][3 channels] Derivative of the colour by position: at x, the SH colour of site p
  // changes by the sum over axes of (x - p)[a] * gradient[a]. Empty: cells of one colour each.
  LargePageVector<float> color_gradient;
  // [N][kIdentityDim] Identity features, each one cache line.
  LargePageVector<float> identity;
  // [K][kIdentityDim] Weights and [K] biases of the linear layer from identities to classes.
  std::vector<float> classifier_weight;
  std::vector<float> classifier_bias;

  size_t NumSites() const { return positions.size(); }
  bool HasSemantics() const { return num_classes > 0; }
  bool HasColorGradients() const { return !color_gradient.empty(); }
  int ShStride() const { return 3 * NumShCoefficients(sh_degree); }
};

// Statistics of each cell over the rays of the training photos. Measured after training
// (foam/view/cell_statistics.h) and stored in the model for the exports.
struct CellStatistics {
  // [N], 0 to 1: the largest rendering weight over all sampled rays; 0: never seen.
  std::vector<float> contribution;
  // [N], display values (sRGB / 255), 0 to 1: the weight-averaged visible colour.
  std::vector<Eigen::Vector3f> mean_color;

  // Evidence of empty space. A ray meets its surface where its transmittance falls to 1/2, and the
  // cells that it crosses before are empty. Sums over the sampled rays, [N], or empty where not
  // measured.
  //
  // Twice the part of the transmittance behind the cell that is above 1/2.
  std::vector<float> passed;
  // Twice the part of the transmittance below 1/2 that the cell takes away.
  std::vector<float> stopped;
};

}  // namespace semfoam
