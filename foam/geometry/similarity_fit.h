// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/sim3.h"

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A similarity between corresponding points.
struct SimilarityFit {
  Sim3 target_from_source;
  // [points] Whether the pair took part in the final fit.
  std::vector<uint8_t> is_inlier;
  int64_t num_inliers = 0;
  // Distances between the target points and the transformed source points, over the inliers, in
  // units of the target frame.
  double rms = 0;
  double max = 0;
};

// Fits target[i] = scale * rotation * source[i] + translation (Umeyama 1991) to all pairs but
// outliers, of which there may be nearly half: the fit of three pairs with the least median of
// squared residuals (LMedS: Rousseeuw 1984; all triples of up to 23 pairs, else 2000 of them) tells
// what an outlier is, beyond 2.5 standard deviations; the others are fitted by least squares. Draws
// are seeded, so the result depends on the input alone. Coordinates may have any offset.
//
// Returns nothing for fewer than three pairs, and where all inliers lie on one line in either frame
// (their second standard deviation is below a hundredth of the first), because then the rotation
// about it is unknown. CHECKs that both have the same size.
std::optional<SimilarityFit> FitSimilarity(const std::vector<Eigen::Vector3d>& source,
                                           const std::vector<Eigen::Vector3d>& target);

}  // namespace semfoam
