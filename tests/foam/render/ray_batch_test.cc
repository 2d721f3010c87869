// SPDX-License-Identifier: GPL-3.0-or-later
//
// A whole batch by vector code against the sum of its rays' gradients by the reference.
#include "foam/render/ray_batch.h"

#include "foam/model/activation.h"
#include "foam/render/update_loops.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "tests/foam/random_cells.h"
#include "tests/foam/render/ray_replay.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kNumSites = 400, kNumClasses = 5, kShDegree = 2, kNumRays = 200;

class RayBatch : public testing::TestWithParam<std::string> {
 protected:
  RayBatch()
      : cells_(RandomSites(kNumSites, 21)),
        parameters_(RandomParameters(
            cells_.float_geometry.positions, kNumSites, kShDegree, kNumClasses, 21)) {
    // What is saturated has gradients beyond the resolution of floats.
    for (float& raw : parameters_.raw_density) raw = std::min(raw, 0.5f);
    for (int i = 0; i < kNumRays; ++i) {
      CounterRandom random(22, 0x53, i);
      RayCase ray;
      ray.origin = RandomPoint(&random, 0.8).cast<float>().cast<double>();
      ray.direction = RandomDirection(&random).cast<float>().cast<double>();
      ray.target.class_index = i % 4 == 3 ? Value(kUnlabelled) : i % kNumClasses;
      ray.target.at_least = i % 5 == 2 ? 3 : 0;
      cases_.push_back(ray);
      BatchRay& in_batch = rays_.emplace_back();
      in_batch.origin = ray.origin.cast<float>();
      in_batch.direction = ray.direction.cast<float>();
      in_batch.start_cell = cells_.BruteForceNearest(ray.origin);
      for (int q = 0; q < kNumQuantiles; ++q) {
        in_batch.quantile_tau[q] = static_cast<float>(ray.quantile_tau[q]);
      }
      in_batch.target = ray.target;
    }
  }
  void SetUp() override { UseSimdTarget(GetParam()); }
  void TearDown() override { UseSimdTarget(""); }

  BatchResult CastRays(const RayLossWeights& weights) const {
    const std::vector<float> density = parameters_.Densities();
    BatchResult result;
    CastBatch(cells_.float_geometry,
              parameters_.Shading(density),
              parameters_.Classifier(),
              weights,
              std::numeric_limits<float>::infinity(),
              rays_,
              &result);
    result.gradients.Distribute(kNumSites);
    return result;
  }

  // The gradient of a cell, as a ParameterRow.
  std::vector<float> CellGradient(const BatchResult& result, uint32_t cell) const {
    std::vector<float> sum(kRow.size, 0.f);
    GradientSum::Bucket bucket;
    for (uint32_t b = 0; cell >= bucket.last_cell(); ++b) result.gradients.Group(b, &bucket);
    SumRecords(bucket.Of(cell),
               result.rays.data(),
               kRow,
               parameters_.positions[cell],
               &parameters_.color_gradient[cell * kColorGradientDim],
               sum.data());
    return sum;
  }

  std::vector<float> IdentityGradient(const BatchResult& result) const {
    std::vector<float> gradient;
    for (uint32_t cell = 0; cell < kNumSites; ++cell) {
      const std::vector<float> row = CellGradient(result, cell);
      gradient.insert(gradient.end(), row.begin(), row.begin() + kIdentityDim);
    }
    return gradient;
  }

  const ParameterRow kRow{kShDegree, true, true};

  WalkableCells cells_;
  FoamParameters<float> parameters_;
  std::vector<RayCase> cases_;
  std::vector<BatchRay> rays_;
};

TEST_P(RayBatch, TrainsIdentitiesAndClassifierAsTheReferenceDoes) {
  const FoamParameters<double> p = Cast<double>(parameters_);
  const RayLossWeights weights{1, 0.7, 0.3, 0.9, 0, 0.2};
  std::vector<double> identity(kNumSites * kIdentityDim), weight(p.weight.size()),
      bias(kNumClasses);
  for (int i = 0; i < kNumRays; ++i) {
    const RayRecord<double> record =
        TraceCase(cells_.geometry, p, p.Densities(), cases_[i], rays_[i].start_cell);
    const auto gradient = HandWrittenGradient(cells_.geometry, record, cases_[i], p, weights);
    for (size_t k = 0; k < identity.size(); ++k) identity[k] += gradient[3][k] / kNumRays;
    for (size_t k = 0; k < weight.size(); ++k) weight[k] += gradient[4][k] / kNumRays;
    for (size_t k = 0; k < bias.size(); ++k) bias[k] += gradient[5][k] / kNumRays;
  }
  const BatchResult result = CastRays(weights);
  const std::vector<float> got = IdentityGradient(result);
  for (size_t k = 0; k < identity.size(); ++k) ASSERT_NEAR(got[k], identity[k], 2e-6) << k;
  for (size_t k = 0; k < weight.size(); ++k) {
    ASSERT_NEAR(result.classifier_weight_gradient[k], weight[k], 5e-6) << k;
  }
  for (size_t k = 0; k < bias.size(); ++k) {
    ASSERT_NEAR(result.classifier_bias_gradient[k], bias[k], 5e-6) << k;
  }
}

TEST_P(RayBatch, TrainsColorsAsTheReferenceDoes) {
  const FoamParameters<double> p = Cast<double>(parameters_);
  const RayLossWeights weights{1, 0.7, 0.3, 0.9, 0, 0.2};
  std::vector<double> sh(p.sh.size()), color_gradient(p.color_gradient.size());
  for (int i = 0; i < kNumRays; ++i) {
    const RayRecord<double> record =
        TraceCase(cells_.geometry, p, p.Densities(), cases_[i], rays_[i].start_cell);
    const auto gradient = HandWrittenGradient(cells_.geometry, record, cases_[i], p, weights);
    for (size_t k = 0; k < sh.size(); ++k) sh[k] += gradient[2][k] / kNumRays;
    for (size_t k = 0; k < color_gradient.size(); ++k) {
      color_gradient[k] += gradient[6][k] / kNumRays;
    }
  }
  double gradient_scale = 0;
  for (const double g : color_gradient) gradient_scale = std::max(gradient_scale, std::abs(g));
  const BatchResult result = CastRays(weights);
  const size_t sh_stride = sh.size() / kNumSites;
  for (uint32_t cell = 0; cell < kNumSites; ++cell) {
    const std::vector<float> got = CellGradient(result, cell);
    for (size_t k = 0; k < sh_stride; ++k) {
      ASSERT_NEAR(got[kRow.sh + k], sh[cell * sh_stride + k], 5e-6) << cell << " " << k;
    }
    for (int k = 0; k < kColorGradientDim; ++k) {
      ASSERT_NEAR(got[kRow.color_gradient + k],
                  color_gradient[cell * kColorGradientDim + k],
                  1e-5 * gradient_scale)
          << cell << " " << k;
    }
  }
}

// A topology older than the positions: what the photos show along rays that it leads astray changes
// nothing; along the others it does.
TEST_P(RayBatch, RaysLedAstrayTeachNothing) {
  std::vector<Eigen::Vector3f> moved = cells_.positions;
  for (int i = 0; i < kNumSites; ++i) {
    CounterRandom random(23, 0x54, i);
    moved[i] += RandomPoint(&random, 0.2).cast<float>();
  }
  Refresh(moved, &cells_.float_geometry);
  const std::vector<float> density = parameters_.Densities();
  std::vector<bool> is_astray;
  for (const BatchRay& ray : rays_) {
    const std::span<RayTrace> trace = ThreadTraces(1);
    trace[0].origin = ray.origin;
    trace[0].direction = ray.direction;
    trace[0].start_cell = ray.start_cell;
    TraceRays(cells_.float_geometry,
              parameters_.Shading(density),
              std::numeric_limits<float>::infinity(),
              trace);
    is_astray.push_back(IsAstray(trace[0].num_segments, std::ssize(trace[0].clamped)));
  }
  const int64_t num_astray = std::count(is_astray.begin(), is_astray.end(), true);
  ASSERT_GT(num_astray, 3);
  ASSERT_LT(num_astray, kNumRays / 2);

  const RayLossWeights weights{1, 0.7, 0.3, 0.9, 0.25, 0.2};
  const auto repainted = [&](bool astray) {
    std::vector<BatchRay> rays = rays_;
    for (int i = 0; i < kNumRays; ++i) {
      if (is_astray[i] != astray) continue;
      rays_[i].target.color[0] += 0.5f;
      rays_[i].target.class_index = (i + 1) % kNumClasses;
    }
    const BatchResult result = CastRays(weights);
    rays_ = rays;
    return result;
  };
  const BatchResult before = CastRays(weights);
  const BatchResult astray = repainted(true), others = repainted(false);
  EXPECT_EQ(astray.totals.mean_loss.color, before.totals.mean_loss.color);
  EXPECT_EQ(astray.totals.mean_loss.identity, before.totals.mean_loss.identity);
  EXPECT_EQ(astray.classifier_weight_gradient, before.classifier_weight_gradient);
  EXPECT_NE(others.totals.mean_loss.color, before.totals.mean_loss.color);
  EXPECT_NE(others.classifier_weight_gradient, before.classifier_weight_gradient);
  bool any_differs = false;
  for (uint32_t cell = 0; cell < kNumSites; ++cell) {
    EXPECT_EQ(CellGradient(astray, cell), CellGradient(before, cell)) << cell;
    any_differs = any_differs || CellGradient(others, cell) != CellGradient(before, cell);
  }
  EXPECT_TRUE(any_differs);
}

TEST(IsAstray, TellsByMoreThanAQuarterOfTheCells) {
  EXPECT_TRUE(IsAstray(31, 8));
  EXPECT_FALSE(IsAstray(32, 8));
  EXPECT_FALSE(IsAstray(10, 7));
  EXPECT_TRUE(IsAstray(35, 9));
  EXPECT_FALSE(IsAstray(0, 0));
}

TEST_P(RayBatch, DoesNotDependOnTheThreads) {
  const RayLossWeights weights{1, 0.7, 0.3, 0.9, 0.25, 0.2};
  const auto cast = [&](int threads) {
    const ThreadLimit limit(threads);
    return CastRays(weights);
  };
  const BatchResult one = cast(1);
  for (const int threads : {2, 5}) {
    const BatchResult other = cast(threads);
    EXPECT_EQ(IdentityGradient(other), IdentityGradient(one));
    EXPECT_EQ(other.classifier_weight_gradient, one.classifier_weight_gradient);
  }
}

// Only where it is asked to, the identity term says something to densities and positions: what the
// reference says.
TEST_P(RayBatch, BendsGeometryByIdentityAsTheReferenceDoes) {
  const FoamParameters<double> p = Cast<double>(parameters_);
  std::vector<std::vector<float>> density_gradients;
  for (const double to_density : {0.0, 0.25, 1.0}) {
    SCOPED_TRACE(to_density);
    std::vector<float>& density_gradient = density_gradients.emplace_back();
    const RayLossWeights weights{1, 0.7, 0.3, 0.9, to_density, 0.2};
    std::vector<double> raw_density(kNumSites), position(3 * kNumSites);
    for (int i = 0; i < kNumRays; ++i) {
      const RayRecord<double> record =
          TraceCase(cells_.geometry, p, p.Densities(), cases_[i], rays_[i].start_cell);
      const auto gradient = HandWrittenGradient(cells_.geometry, record, cases_[i], p, weights);
      for (size_t k = 0; k < position.size(); ++k) position[k] += gradient[0][k] / kNumRays;
      for (int k = 0; k < kNumSites; ++k) raw_density[k] += gradient[1][k] / kNumRays;
    }
    double position_scale = 0, density_scale = 0;
    for (const double g : position) position_scale = std::max(position_scale, std::abs(g));
    for (const double g : raw_density) density_scale = std::max(density_scale, std::abs(g));
    const BatchResult result = CastRays(weights);
    for (uint32_t cell = 0; cell < kNumSites; ++cell) {
      const std::vector<float> sum = CellGradient(result, cell);
      const double by_raw = sum[kRow.density] * DensityDerivative(p.raw_density[cell]);
      ASSERT_NEAR(by_raw, raw_density[cell], 1e-4 * density_scale) << cell;
      for (int a = 0; a < 3; ++a) {
        ASSERT_NEAR(sum[kRow.position + a], position[3 * cell + a], 1e-4 * position_scale) << cell;
      }
      density_gradient.push_back(sum[kRow.density]);
    }
  }
  EXPECT_NE(density_gradients[0], density_gradients[1]);
  EXPECT_NE(density_gradients[1], density_gradients[2]);
}

INSTANTIATE_TEST_SUITE_P(InstructionSets,
                         RayBatch,
                         testing::ValuesIn(SimdTargets()),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace semfoam
