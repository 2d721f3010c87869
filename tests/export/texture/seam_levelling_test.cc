// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/texture/seam_levelling.h"

#include "foam/image/srgb.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

std::array<uint8_t, 3> Display(const Eigen::Vector3d& light) {
  std::array<uint8_t, 3> color;
  for (int c = 0; c < 3; ++c) {
    color[c] = static_cast<uint8_t>(std::lround(255 * DisplayFromLinear(light[c])));
  }
  return color;
}

// Three photos with light of their own, each vertex in two of them; one in ten is an outlier.
TEST(PhotoGains, TakesOutTheLightOfEachPhoto) {
  const std::vector<Eigen::Vector3d> light = {{1, 1, 1}, {1.06, 1.02, 0.97}, {0.95, 1, 1.05}};
  std::mt19937 random(3);
  std::uniform_real_distribution<double> value(0.1, 0.6);
  std::vector<VertexObservation> observations;
  for (int v = 0; v < 3000; ++v) {
    const Eigen::Vector3d color(value(random), value(random), value(random));
    for (int k = 0; k < 2; ++k) {
      const int photo = (v + k) % 3;
      Eigen::Vector3d seen = color.cwiseProduct(light[photo]);
      if (v % 10 == 0 && k == 1) seen *= 0.5;
      observations.push_back({photo, 1, Display(seen)});
    }
    observations.push_back({});  // none
  }
  const std::vector<Eigen::Vector3d> gains = PhotoGains(observations, 3, 4);
  ASSERT_EQ(gains.size(), 4u);
  for (int photo = 1; photo < 3; ++photo) {
    const Eigen::Vector3d together =
        gains[photo].cwiseProduct(light[photo]).cwiseQuotient(gains[0]);
    EXPECT_LT((together - Eigen::Vector3d::Ones()).cwiseAbs().maxCoeff(), 0.01) << photo;
  }
  EXPECT_EQ(gains[3], Eigen::Vector3d::Ones());  // shows nothing
}

// A strip of triangles, known at its ends.
TEST(ExtendOverSurface, GoesFromKnownVerticesToOthers) {
  std::vector<std::array<uint32_t, 3>> triangles;
  constexpr uint32_t kLength = 20;
  for (uint32_t i = 0; i + 1 < kLength; ++i) {
    const uint32_t a = 2 * i, b = a + 1, c = a + 2, d = a + 3;
    for (const auto& [p, q, r] : {std::array{a, c, b}, std::array{b, c, d}}) {
      triangles.push_back({p, q, r});
      triangles.push_back({p, r, q});  // both sides, so that it is closed
    }
  }
  std::vector<uint8_t> is_known(2 * kLength + 1, 0);
  std::vector<Eigen::Vector3f> values(is_known.size(), Eigen::Vector3f::Constant(100));
  is_known[0] = is_known[1] = 1;
  values[0] = values[1] = Eigen::Vector3f(10, 0, 0);
  is_known[2 * kLength - 2] = is_known[2 * kLength - 1] = 1;
  values[2 * kLength - 2] = values[2 * kLength - 1] = Eigen::Vector3f(0, 10, 0);
  ExtendOverSurface(triangles, is_known, &values);
  EXPECT_EQ(values[0], Eigen::Vector3f(10, 0, 0));
  for (uint32_t i = 2; i + 2 < 2 * kLength; i += 2) {
    EXPECT_LE(values[i].x(), values[i - 2].x());
    EXPECT_GE(values[i].x(), 0);
    EXPECT_LE(values[i].sum(), 10);
    EXPECT_GT(values[i].sum(), 7);
  }
  EXPECT_EQ(values.back(), Eigen::Vector3f::Zero().eval());  // of no triangle
}

}  // namespace
}  // namespace semfoam
