// SPDX-License-Identifier: GPL-3.0-or-later
// Segments of rays against numeric integration.
#include "foam/render/compositing.h"

#include "foam/model/spherical_harmonics.h"

#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include <ceres/jet.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// Integrates over [begin, end] by Gauss-Legendre with five points on each of `pieces` intervals.
double Integral(const std::function<double(double)>& f, double begin, double end, int pieces) {
  constexpr std::array<double, 3> kPoints = {0, 0.5384693101056831, 0.9061798459386640};
  constexpr std::array<double, 3> kWeights = {
      0.5688888888888889, 0.4786286704993665, 0.2369268850561891};
  const double half = (end - begin) / pieces / 2;
  double sum = 0;
  for (int i = 0; i < pieces; ++i) {
    const double middle = begin + (2 * i + 1) * half;
    sum += kWeights[0] * f(middle);
    for (int k = 1; k < 3; ++k) {
      sum += kWeights[k] * (f(middle - half * kPoints[k]) + f(middle + half * kPoints[k]));
    }
  }
  return half * sum;
}

// The mean of s over [0, 1] under the weight exp(-x s).
double ShareByIntegration(double x) {
  const double end = std::min(1.0, 50 / x);
  return Integral([&](double s) { return s * std::exp(-x * s); }, 0, end, 100) /
         Integral([&](double s) { return std::exp(-x * s); }, 0, end, 100);
}

TEST(CentroidShare, IsTheMeanUnderTheWeight) {
  for (double x = 1e-6; x < 1e6; x *= 1.3) {
    EXPECT_NEAR(CentroidShare(x), ShareByIntegration(x), 1e-12) << x;
    EXPECT_NEAR(CentroidShare(float(x)), CentroidShare(double(float(x))), 2e-7) << x;
  }
  EXPECT_EQ(CentroidShare(0.0), 0.5);
}

TEST(CentroidShare, HasTheDerivativeOfJet) {
  using Jet = ceres::Jet<double, 1>;
  for (double x = 1e-6; x < 1e6; x *= 1.3) {
    const double expected = CentroidShare(Jet(x, 0)).v[0];
    // Jet subtracts two terms of 1 / x^2.
    EXPECT_NEAR(CentroidShareDerivative(x), expected, 1e-9 * std::abs(expected) + 1e-14) << x;
    // In float they cancel to an error of some units in the last place of 1 / x^2 <= 4.
    EXPECT_NEAR(CentroidShareDerivative(float(x)), expected, 2e-6) << x;
  }
  EXPECT_EQ(CentroidShareDerivative(0.0), -1.0 / 12);
}

TEST(CentroidShare, IsFiniteUpToTheLargestNumbers) {
  for (const float x : {80.f, 90.f, 1e3f, 1e19f, 1e30f, 3e38f}) {
    EXPECT_GE(CentroidShare(x), 0) << x;
    EXPECT_LE(CentroidShare(x), 1 / x * 1.001f) << x;
    EXPECT_LE(CentroidShareDerivative(x), 0) << x;
    EXPECT_GE(CentroidShareDerivative(x), -2 / x) << x;
  }
}

TEST(LinearColor, IsTheIntegralOfEmissionAlongTheRay) {
  const std::vector<double> sh = {0.3, -0.1, 0.7};
  const std::vector<double> gradient = {0.5, -0.2, 0.1, 0.3, 0.4, -0.6, -0.7, 0.2, 0.3};
  const Eigen::Vector3d site(0.1, 0.2, 2), origin(0.3, -0.1, 0);
  const Eigen::Vector3d direction = Eigen::Vector3d(-0.1, 0.2, 1).normalized();
  const double basis = kShDc;
  for (const double sigma : {1e-3, 0.3, 2.0, 40.0, 1e4}) {
    RayComposite<double> ray;
    ray.tau = 0.7;
    const ShadedSegment<double> segment = AddSegment(1.7, 2.4, sigma, 0, &ray);
    double color[3], slope[3];
    LinearColor(&basis,
                1,
                sh.data(),
                gradient.data(),
                Eigen::Vector3d(origin + segment.centroid * direction - site),
                direction,
                color,
                slope);
    for (int c = 0; c < 3; ++c) {
      const auto emission = [&](double t) {
        const Eigen::Vector3d offset = origin + t * direction - site;
        const double here = 0.5 + basis * sh[c] + offset[0] * gradient[c] +
                            offset[1] * gradient[3 + c] + offset[2] * gradient[6 + c];
        return sigma * std::exp(-0.7 - sigma * (t - 1.7)) * here;
      };
      const double end = std::min(2.4, 1.7 + 50 / sigma);
      EXPECT_NEAR(segment.weight * color[c], Integral(emission, 1.7, end, 200), 1e-12) << sigma;
    }
  }
}

TEST(LinearColor, StaysTheSameWhenItsSiteMoves) {
  std::vector<float> sh = {0.3f, -0.1f, 0.7f};
  const std::vector<float> gradient = {0.5f, -0.2f, 0.1f, 0.3f, 0.4f, -0.6f, -0.7f, 0.2f, 0.3f};
  const float basis = static_cast<float>(kShDc);
  const Eigen::Vector3f offset(0.05f, -0.1f, 0.2f), moved(0.1f, 0.2f, -0.1f);
  float before[3], after[3], slope[3];
  LinearColor<float>(
      &basis, 1, sh.data(), gradient.data(), offset, Eigen::Vector3f::UnitX(), before, slope);
  ShiftColor(moved, gradient.data(), sh.data());
  const Eigen::Vector3f rest = offset - moved;
  LinearColor<float>(
      &basis, 1, sh.data(), gradient.data(), rest, Eigen::Vector3f::UnitX(), after, slope);
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(after[c], before[c], 1e-6f);
    EXPECT_EQ(slope[c], gradient[c]);
  }
}

}  // namespace
}  // namespace semfoam
