// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/similarity_fit.h"

#include "foam/util/random.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

const Sim3 kTrue = {2.5,
                    Eigen::AngleAxisd(2, Eigen::Vector3d(1, -1, 3).normalized()).toRotationMatrix(),
                    {4e5, 5e6, 120}};

struct Pairs {
  std::vector<Eigen::Vector3d> source, target;
};

// Cameras in a box, and where they were measured to be, with noise.
Pairs MeasuredCameras(int count, double noise) {
  Pairs pairs;
  for (int i = 0; i < count; ++i) {
    CounterRandom random(7, 8, i);
    const double x = random.Uniform(), y = random.Uniform(), z = random.Uniform();
    pairs.source.emplace_back(10 * x, 8 * y, 0.5 * z);
    const double a = random.Normal(), b = random.Normal(), c = random.Normal();
    pairs.target.emplace_back(kTrue.Apply(pairs.source.back()) + noise * Eigen::Vector3d(a, b, c));
  }
  return pairs;
}

TEST(SimilarityFit, ExactPositionsGiveTheTransform) {
  for (const int count : {3, 4, 64}) {
    const Pairs pairs = MeasuredCameras(count, 0);
    const std::optional<SimilarityFit> fit = FitSimilarity(pairs.source, pairs.target);
    ASSERT_TRUE(fit) << count;
    EXPECT_NEAR(fit->target_from_source.scale, 2.5, 1e-8);
    EXPECT_LT((fit->target_from_source.rotation - kTrue.rotation).norm(), 1e-7);
    EXPECT_NEAR(fit->target_from_source.rotation.determinant(), 1, 1e-12);
    EXPECT_EQ(fit->num_inliers, count);
    EXPECT_LT(fit->max, 1e-6);
  }
}

TEST(SimilarityFit, AThirdOfOutliersIsLeftOut) {
  for (const int count : {12, 90}) {
    Pairs pairs = MeasuredCameras(count, 0.02);
    for (int i = 0; i < count; i += 3) pairs.target[i] += Eigen::Vector3d(i + 5, 20, -8);
    const std::optional<SimilarityFit> fit = FitSimilarity(pairs.source, pairs.target);
    ASSERT_TRUE(fit);
    for (int i = 0; i < count; i += 3) EXPECT_FALSE(fit->is_inlier[i]) << i;
    EXPECT_GE(fit->num_inliers, 2 * count / 3 - count / 10);
    EXPECT_NEAR(fit->target_from_source.scale, 2.5, 0.02);
    EXPECT_LT((fit->target_from_source.rotation - kTrue.rotation).norm(), 0.03);
    EXPECT_NEAR(fit->rms, 0.035, 0.015);
  }
}

TEST(SimilarityFit, TooFewAndCollinearPositionsGiveNone) {
  Pairs pairs = MeasuredCameras(2, 0);
  EXPECT_FALSE(FitSimilarity(pairs.source, pairs.target));
  pairs = MeasuredCameras(40, 0);
  for (size_t i = 0; i < pairs.source.size(); ++i) {
    pairs.source[i] = static_cast<double>(i) * Eigen::Vector3d(1, 2, 3);
    pairs.target[i] = kTrue.Apply(pairs.source[i]);
  }
  EXPECT_FALSE(FitSimilarity(pairs.source, pairs.target));
  // All measured in one place.
  pairs = MeasuredCameras(40, 0);
  for (Eigen::Vector3d& x : pairs.target) x = {1, 2, 3};
  EXPECT_FALSE(FitSimilarity(pairs.source, pairs.target));
}

}  // namespace
}  // namespace semfoam
