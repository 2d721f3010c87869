// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/surface_seeds_file.h"

#include "foam/train/checkpoint.h"

#include "tests/plugin/test_util.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// Of three photos, the second of which was not swept.
SurfaceSeeds Sweep() {
  SurfaceSeeds found;
  found.points = {{{1, 2, 3}, {0.25f, 0.5f, 1}, true}, {{-4, 5e-6f, 0}, {0, 0, 0.125f}, true}};
  found.depths.resize(3);
  found.depths[0] = {2, 1, {10, 11}, {1, 0.5f}, {0.25f, 0}};
  found.depths[2] = {1, 3, {12, 13}, {0.5f, 1.5f}, {1, 2, 3}};
  found.far_share = 0.0625;
  found.num_far = 2;
  found.has_support = true;
  found.solid_ground = SolidGround{{0, 1, 0}, -2, {3, 4, 5}, 6, 0.125f};
  found.num_swept = 2;
  found.num_training = 7;
  found.seconds = 1.5;
  return found;
}

TEST(SurfaceSeedsFile, ComesBack) {
  const TempFolder temp;
  const SurfaceSeeds found = Sweep();
  WriteSurfaceSeeds(temp / "sweep.ckpt", found);
  const SurfaceSeeds read = ReadSurfaceSeeds(temp / "sweep.ckpt", 3);
  ASSERT_EQ(read.points.size(), found.points.size());
  for (size_t i = 0; i < found.points.size(); ++i) {
    EXPECT_EQ(read.points[i].position, found.points[i].position);
    EXPECT_EQ(read.points[i].color, found.points[i].color);
    EXPECT_TRUE(read.points[i].is_dense);
  }
  ASSERT_EQ(read.depths.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(read.depths[i].width, found.depths[i].width);
    EXPECT_EQ(read.depths[i].height, found.depths[i].height);
    EXPECT_EQ(read.depths[i].focal, found.depths[i].focal);
    EXPECT_EQ(read.depths[i].center, found.depths[i].center);
    EXPECT_EQ(read.depths[i].inverse, found.depths[i].inverse);
  }
  EXPECT_EQ(read.far_share, found.far_share);
  EXPECT_EQ(read.num_far, found.num_far);
  EXPECT_FALSE(read.has_ground);
  EXPECT_TRUE(read.has_support);
  ASSERT_TRUE(read.solid_ground);
  EXPECT_EQ(read.solid_ground->up, found.solid_ground->up);
  EXPECT_EQ(read.solid_ground->thickness, found.solid_ground->thickness);
  EXPECT_EQ(read.Report(), found.Report());
}

TEST(SurfaceSeedsFile, OfNothingFoundComesBack) {
  const TempFolder temp;
  WriteSurfaceSeeds(temp / "sweep.ckpt", {});
  const SurfaceSeeds read = ReadSurfaceSeeds(temp / "sweep.ckpt", 3);
  EXPECT_TRUE(read.points.empty());
  EXPECT_TRUE(read.depths.empty());
  EXPECT_FALSE(read.solid_ground);
}

TEST(SurfaceSeedsFile, OfOtherPhotosOrCutIsRefused) {
  const TempFolder temp;
  WriteSurfaceSeeds(temp / "sweep.ckpt", Sweep());
  EXPECT_THROW(ReadSurfaceSeeds(temp / "sweep.ckpt", 4), DamagedCheckpoint);
  const std::string bytes = ReadFile(temp / "sweep.ckpt");
  WriteFile(temp / "sweep.ckpt", bytes.substr(0, bytes.size() - 9));
  EXPECT_THROW(ReadSurfaceSeeds(temp / "sweep.ckpt", 3), DamagedCheckpoint);
}

}  // namespace
}  // namespace semfoam
