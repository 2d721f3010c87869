// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/far_regions.h"

#include "foam/util/parallel.h"

#include <cmath>
#include <functional>
#include <vector>

#include "tests/plugin/stereo/grey_views.h"
#include <Eigen/Core>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kWidth = 160, kHeight = 120;
// Above it, nothing is known of the pixels' depths.
constexpr int kHorizon = 60;
constexpr double kFocal = 120, kBaseline = 0.5;

// What is seen from a place in a direction.
using Light =
    std::function<double(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction)>;

// Clouds: slow waves over the directions, or over places.
double Clouds(const Eigen::Vector3d& at) {
  return 0.6 + 0.1 * std::sin(9 * at.x() + 4 * at.y()) * std::cos(7 * at.y() - 3 * at.x());
}

double Sky(const Eigen::Vector3d&, const Eigen::Vector3d& direction) {
  return Clouds(direction / direction.z());
}

// A wall at z = 2, with the same clouds painted on it.
double Wall(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  return Clouds(origin / 2 + direction / direction.z());
}

double Plain(const Eigen::Vector3d&, const Eigen::Vector3d&) { return 0.6; }

// Views side by side that look the same way, with a little noise.
std::vector<StereoView> ViewsOf(const Light& light, double baseline = kBaseline) {
  std::vector<StereoView> views;
  for (int i = 0; i < 6; ++i) {
    StereoView view = PinholeView(i, kWidth, kHeight, kFocal);
    view.origin = {baseline * (i - 2.5), 0, 0};
    AddPixelsOfRays(
        [&](const Eigen::Vector3d& ray) { return light(view.origin, ray); }, 0.01, &view);
    views.push_back(view);
  }
  return views;
}

std::vector<RegionInput> KnownBelowTheHorizon() {
  RegionInput input;
  input.nearest = 1;
  for (int y = 0; y < kHeight; ++y)
    input.is_known.insert(input.is_known.end(), kWidth, y >= kHorizon);
  return std::vector<RegionInput>(6, input);
}

// Returns the share of the pixels of unknown depth that are far.
double FarShare(const std::vector<StereoView>& views) {
  int64_t count = 0;
  for (const std::vector<uint8_t>& far : FindFarRegions(views, KnownBelowTheHorizon())) {
    for (size_t at = 0; at < far.size(); ++at) {
      count += far[at];
      EXPECT_FALSE(far[at] != 0 && at >= size_t{kHorizon} * kWidth) << "its depth is known";
    }
  }
  return static_cast<double>(count) / (6.0 * kHorizon * kWidth);
}

TEST(FarRegions, AreOfSky) { EXPECT_GT(FarShare(ViewsOf(Sky)), 0.95); }

TEST(FarRegions, AreNotOfAWall) { EXPECT_EQ(FarShare(ViewsOf(Wall)), 0); }

TEST(FarRegions, AreNotOfWhatIsPlain) { EXPECT_EQ(FarShare(ViewsOf(Plain)), 0); }

// All is at one place in photos that were taken at one.
TEST(FarRegions, NeedPhotosFromDifferentPlaces) {
  EXPECT_EQ(FarShare(ViewsOf(Sky, 0)), 0);
  EXPECT_EQ(FarShare(ViewsOf(Sky, 0.02)), 0);
}

TEST(FarRegions, DoWithoutViewsThatTakeNoPart) {
  const std::vector<StereoView> views = ViewsOf(Sky);
  std::vector<RegionInput> inputs = KnownBelowTheHorizon();
  inputs[2].is_known.clear();
  const std::vector<std::vector<uint8_t>> far = FindFarRegions(views, inputs);
  EXPECT_TRUE(far[2].empty());
  EXPECT_EQ(far[3][0], 1);
}

TEST(FarRegions, DoNotDependOnTheNumberOfThreads) {
  const std::vector<StereoView> views = ViewsOf(Sky);
  std::vector<std::vector<std::vector<uint8_t>>> results;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    results.push_back(FindFarRegions(views, KnownBelowTheHorizon()));
  }
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

}  // namespace
}  // namespace semfoam
