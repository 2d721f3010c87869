// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/matter_search.h"

#include <limits>
#include <random>

#include "tests/export/test_foams.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// Nearest site, by trying all.
uint32_t CellOf(const ExportableScene& scene, const Eigen::Vector3d& x) {
  uint32_t nearest = 0;
  for (uint32_t i = 1; i < scene.NumSites(); ++i) {
    if ((scene.cell_positions[i].cast<double>() - x).squaredNorm() <
        (scene.cell_positions[nearest].cast<double>() - x).squaredNorm()) {
      nearest = i;
    }
  }
  return nearest;
}

class MatterSearchTest : public ::testing::Test {
 protected:
  MatterSearchTest() : scene_(MakeExportableScene(TouchingBalls(1500))) {}

  bool IsMatter(uint32_t cell) const { return scene_.object_of_cell[cell] >= 0; }

  const ExportableScene scene_;
  std::mt19937 random_{5};
  std::uniform_real_distribution<double> coordinate_{-0.9, 0.9};
  Eigen::Vector3d Random() {
    const double x = coordinate_(random_), y = coordinate_(random_), z = coordinate_(random_);
    return {x, y, z};
  }
};

// Held against small steps along the line.
TEST_F(MatterSearchTest, AlongANormalItIsTheFirstMatterOnEitherSide) {
  const MatterSearch search(scene_, 0.4);
  uint32_t hint = 0;
  int met = 0;
  for (int k = 0; k < 150; ++k) {
    const Eigen::Vector3d x = 0.8 * Random(), normal = x + 0.4 * Random();
    const MatterSearch::Found found = search.Find(x, normal, &hint);
    EXPECT_EQ(hint, CellOf(scene_, x));
    double first = std::numeric_limits<double>::infinity();
    for (double t = 0; t < 0.4 && first > t; t += 4e-3) {
      for (const double sign : {1., -1.}) {
        if (IsMatter(CellOf(scene_, x + sign * t * normal.normalized()))) first = t;
      }
    }
    if (first > 0.395) continue;
    ++met;
    ASSERT_NE(found.cell, kNoCell);
    EXPECT_TRUE(IsMatter(found.cell));
    EXPECT_NEAR(found.distance, first, 5e-3);
  }
  EXPECT_GT(met, 40);
}

// Held against small steps in many directions: no matter is nearer than what is found, and that is
// as near as its plane.
TEST_F(MatterSearchTest, WithoutANormalItIsTheNearestMatter) {
  const MatterSearch search(scene_, 0.3);
  uint32_t hint = 0;
  int met = 0, none = 0;
  for (int k = 0; k < 60; ++k) {
    const Eigen::Vector3d x = Random();
    const MatterSearch::Found found = search.Find(x, Eigen::Vector3d::Zero(), &hint);
    double nearest = std::numeric_limits<double>::infinity();
    for (int direction = 0; direction < 60; ++direction) {
      const Eigen::Vector3d along = Random().normalized();
      for (double t = 0; t < 0.4 && t < nearest; t += 1e-2) {
        if (IsMatter(CellOf(scene_, x + t * along))) nearest = t;
      }
    }
    if (found.cell == kNoCell) {
      EXPECT_GT(nearest, 0.3);
      ++none;
      continue;
    }
    ++met;
    EXPECT_TRUE(IsMatter(found.cell));
    EXPECT_LE(found.distance, nearest);
    const Eigen::Vector3d site = scene_.cell_positions[CellOf(scene_, x)].cast<double>();
    const Eigen::Vector3d other = scene_.cell_positions[found.cell].cast<double>();
    const double to_plane = (0.5 * (site + other) - x).dot((other - site).stableNormalized());
    EXPECT_NEAR(found.distance, to_plane, 1e-9);
  }
  EXPECT_GT(met, 15);
  EXPECT_GT(none, 5);
}

TEST_F(MatterSearchTest, PlacesAreInTheFrameOfTheFiles) {
  ExportableSceneOptions options;
  options.transform.scale = 10;
  options.transform.rotation =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  options.transform.translation = {500, -3, 7};
  const ExportableScene moved = MakeExportableScene(TouchingBalls(1500), options);
  const MatterSearch search(scene_, 0.3), moved_search(moved, 3);
  EXPECT_NEAR(moved_search.resolution(), 10 * search.resolution(), 1e-6);
  EXPECT_DOUBLE_EQ(moved_search.tolerance(), 3);
  uint32_t hint = 0;
  for (int k = 0; k < 100; ++k) {
    const Eigen::Vector3d x = Random(), normal = Random();
    const MatterSearch::Found found = search.Find(x, normal, &hint);
    const MatterSearch::Found there = moved_search.Find(
        options.transform.scale * (options.transform.rotation * x) + options.transform.translation,
        options.transform.rotation * normal,
        &hint);
    EXPECT_EQ(there.cell, found.cell);
    EXPECT_NEAR(there.distance, found.distance, 1e-5);
  }
}

TEST_F(MatterSearchTest, TheLabelIsTheObjectsAndThePlaceMayBeNone) {
  const MatterSearch search(scene_, 0.1);
  uint32_t hint = 0;
  const auto at = [&](double x, double y, double z) {
    return search.LabelOf(search.Find({x, y, z}, {0, 0, 1}, &hint));
  };
  EXPECT_EQ(at(-0.3, 0, 0.32).id, LabelId{7});
  EXPECT_EQ(at(0.3, 0, 0).id, LabelId{8});
  EXPECT_GT(at(0.3, 0, 0).confidence, 0.5f);
  EXPECT_EQ(at(0, 0.9, 0.9), SurfaceLabel());
  EXPECT_EQ(at(std::numeric_limits<double>::quiet_NaN(), 0, 0), SurfaceLabel());
  EXPECT_NEAR(search.DistanceToMatter({-0.3, 0, 10}), 9.75, 0.1);
}

// Matter whose class is that of unlabelled pixels is matter, and has no label.
TEST(MatterSearch, UnlabelledMatterHidesWhatIsBehind) {
  Model model = TouchingBalls(1500);
  model.labels[1] = {kNoObject, kZeroMaskId, ""};
  const ExportableScene scene = MakeExportableScene(model);
  const MatterSearch search(scene, 2);
  uint32_t hint = 0;
  const MatterSearch::Found found = search.Find({0.7, 0, 0}, {1, 0, 0}, &hint);
  ASSERT_NE(found.cell, kNoCell);
  EXPECT_EQ(search.LabelOf(found).id, kNoObject);
  EXPECT_GT(search.LabelOf(found).confidence, 0.5f);
}

}  // namespace
}  // namespace semfoam
