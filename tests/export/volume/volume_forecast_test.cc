// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/volume/volume_forecast.h"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// In a box of 10 x 4 x 1 at a far offset; one in 20 is far off.
std::vector<Eigen::Vector3d> Points() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Eigen::Vector3d> points;
  for (int k = 0; k < 2000; ++k) {
    const double far = k % 20 == 0 ? 1000 : 1;
    const double x = unit(random), y = unit(random), z = unit(random);
    points.emplace_back(5e5 + 10 * far * x, 4e6 + 4 * far * y, far * z);
  }
  return points;
}

std::string Said(const VolumeExportOptions& options, double scale = 1) {
  return VoxelsThatCannotFit(Points(), scale, options);
}

TEST(VolumeForecast, RefusesWhatCannotFit) {
  VolumeExportOptions options;
  EXPECT_EQ(Said(options), "");
  options.voxel_size = 1e-9;
  EXPECT_THAT(Said(options), StartsWith("voxel_size 1e-09 is too small: the model's points are 8"));
  EXPECT_THAT(Said(options), HasSubstr("more voxels along an edge than the"));
  // About 8 x 0.8 of a sheet: 5e8 voxels of 1.1e-4.
  options.voxel_size = 1e-4;
  EXPECT_THAT(Said(options),
              HasSubstr("voxels, more than the 500000000 of max_voxels; a voxel_size"));
  options.voxel_size = 2e-4;
  EXPECT_EQ(Said(options), "") << "nobody knows yet";
  // In files of another unit.
  options.voxel_size = 1e-4;
  EXPECT_EQ(Said(options, 0.01), "");
  options.voxel_size = 0.01;
  EXPECT_NE(Said(options, 1000), "");
}

TEST(VolumeForecast, KnowsTheOtherOptions) {
  VolumeExportOptions options;
  options.max_voxels = 10;
  options.voxel_size = 0.1;
  EXPECT_NE(Said(options), "");
  // A named object may be as small as it likes, but the grid's indices count from the scene.
  options.objects.only.emplace();
  EXPECT_EQ(Said(options), "");
  options.voxel_size = 1e-9;
  EXPECT_NE(Said(options), "");
  options = {};
  options.max_resolution = 65536;
  EXPECT_EQ(Said(options), "") << "of the far points' box";
  options.max_voxels = 1;
  EXPECT_THAT(Said(options), StartsWith("max_resolution 65536 is too large: "));
  // A crop with hardly a point tells nothing.
  options = {};
  options.voxel_size = 1e-9;
  options.crop = "0,0,0,1,1,1";
  EXPECT_EQ(Said(options), "");
  options.crop = "500000,4000000,0,500005,4000004,1";
  EXPECT_NE(Said(options), "");
  EXPECT_EQ(VoxelsThatCannotFit({}, 1, options), "");
}

}  // namespace
}  // namespace semfoam
