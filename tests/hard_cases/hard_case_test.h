// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <limits>
#include <ostream>
#include <set>
#include <string>
#include <vector>

#include "tests/hard_cases/hard_case.h"
#include <ceres/jet.h>
#include <gtest/gtest.h>

// The hard cases of one family as GoogleTest tests, with ceres::Jet as the oracle of the gradients
// in double.

namespace semfoam {

// The largest deviation of the hand-written gradient of one ray from ceres::Jet's along the same
// cells: all parameters of some forty cells, spread over the ray, and the classifier's.
inline double DeviationFromJet(const RayScene& scene, const RayCase& ray, uint32_t start) {
  using Jet = ceres::Jet<double, 1>;
  constexpr size_t kCells = 40;
  constexpr double kSegmentBudget = 5e5;  // segments replayed
  const WalkGeometry<double>& geometry = scene.cells.geometry;
  const FoamParameters<double>& values = scene.values_in_double;
  const RayRecord<double> record = TraceCase(geometry, values, scene.density_in_double, ray, start);
  if (record.segments.empty()) return 0;
  const auto gradient = HandWrittenGradient(geometry, record, ray, values, kHardCaseWeights);
  std::vector<double> logits(values.num_classes);
  RayLoss(record.composite, ray.target, values.Classifier(), logits.data());
  const RayGradient<double> by_ray = RayLossGradient(
      record.composite, ray.target, values.Classifier(), kHardCaseWeights, logits.data());
  const auto scales = GradientScales(geometry, values, record, by_ray);

  FoamParameters<Jet> jets = Cast<Jet>(values);
  double deviation = 0;
  const auto compare = [&](int kind, size_t k, double scale) {
    Jet* const parameter = jets.Find(kind, k);
    parameter->v[0] = 1;
    const double oracle = ReplayLoss(record, ray, jets, kHardCaseWeights).v[0];
    parameter->v[0] = 0;
    const double difference = std::abs(gradient[kind][k] - oracle);
    // NaN counts as infinitely far off.
    deviation = std::max(deviation,
                         std::isfinite(difference) ? difference / (scale + 1e-300)
                                                   : std::numeric_limits<double>::infinity());
  };

  const size_t num_coefficients = NumShCoefficients(values.sh_degree);
  const double parameters_of_cell = 4 + 3 * num_coefficients + kColorGradientDim + kIdentityDim;
  const size_t num_cells = std::clamp<size_t>(
      kSegmentBudget / parameters_of_cell / (record.segments.size() + 4 * values.num_classes),
      2,
      kCells);
  std::set<uint32_t> cells;
  for (size_t k = 0; k < num_cells; ++k) {
    cells.insert(
        record.segments[k * (record.segments.size() - 1) / std::max<size_t>(1, num_cells - 1)]
            .cell);
  }
  double largest_identity = 1;
  for (const double f : record.composite.identity) {
    largest_identity = std::max(largest_identity, std::abs(f));
  }
  for (const uint32_t cell : cells) {
    if (cell >= scene.NumSites()) continue;  // guards do not learn
    const GradientScale& scale = scales.at(cell);
    for (int a = 0; a < 3; ++a) compare(0, 3 * size_t(cell) + a, scale.position);
    compare(1, cell, scale.density * DensityDerivative(values.raw_density[cell]));
    for (size_t k = 0; k < 3 * num_coefficients; ++k) {
      compare(2, 3 * num_coefficients * cell + k, scale.weight);
    }
    // A sum over offsets of centroids, each as exact as the lengths that it is the difference of.
    const double reach =
        record.origin.norm() + record.segments.back().t_out + values.positions[cell].norm();
    for (int k = 0; k < kColorGradientDim; ++k) {
      compare(6, size_t(cell) * kColorGradientDim + k, scale.weight * reach);
    }
    for (int c = 0; values.num_classes > 0 && c < kIdentityDim; ++c) {
      double by_identity = 0;
      for (int k = 0; k < values.num_classes; ++k) {
        by_identity += std::abs(values.weight[k * kIdentityDim + c]);
      }
      compare(3, size_t(cell) * kIdentityDim + c, scale.weight * by_identity);
    }
  }
  const size_t num_weights = std::min<size_t>(values.weight.size(), 64);
  for (size_t k = 0; k < num_weights; ++k) compare(4, k, largest_identity);
  for (size_t k = 0; k < std::min<size_t>(values.bias.size(), 8); ++k) compare(5, k, 1);
  return deviation;
}

inline void ExpectPasses(const HardCase& hard_case) {
  const HardCaseResult result = hard_case.run({DeviationFromJet, Device()});
  for (const std::string& failure : result.failures) ADD_FAILURE() << failure;
  for (const auto& [variant, d] : result.deviations) {
    std::printf("%-14s walk %8.2g, weights %8.2g, gradient %8.2g, colour %8.2g\n",
                variant.c_str(),
                d.walk,
                d.weights,
                d.gradient,
                d.color);
  }
}

inline void PrintTo(const HardCase& hard_case, std::ostream* out) { *out << hard_case.expected; }

// One test per case, named after it.
class HardCaseTest : public testing::TestWithParam<HardCase> {};

inline std::string HardCaseName(const testing::TestParamInfo<HardCase>& info) {
  std::string name = info.param.name;
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

}  // namespace semfoam
