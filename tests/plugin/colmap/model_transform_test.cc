// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/model_transform.h"

#include <algorithm>
#include <map>
#include <sstream>

#include "tests/plugin/colmap/colmap_program.h"
#include "tests/plugin/colmap/small_model.h"
#include "tests/plugin/test_util.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

const Sim3 kTransform = {
    2.5,
    Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, -2, 1).normalized()).toRotationMatrix(),
    {10, 20, 30}};

TEST(ModelTransform, DoesWhatColmapDoes) {
  const TempFolder temp;
  WriteColmapTransform(temp, kTransform, temp / "transform.txt");
  const std::filesystem::path input = SEMFOAM_TEST_DATA "/tabletop/sparse/0";
  RunColmap(temp,
            "model_transformer",
            input,
            temp / "moved",
            "--transform_path '" + (temp / "transform.txt").string() + "'");
  const Reconstruction theirs = ReadReconstruction(temp / "moved");
  Reconstruction ours = ReadReconstruction(input);
  TransformReconstruction(kTransform, &ours);
  // COLMAP writes them in another order.
  std::map<uint32_t, Pose> poses;
  for (const Image& image : theirs.images) poses[image.id] = image.cam_from_world;
  ASSERT_EQ(poses.size(), ours.images.size());
  double farthest = 0;
  for (const Image& image : ours.images) {
    const Pose &a = image.cam_from_world, &b = poses.at(image.id);
    farthest = std::max(farthest, (a.Center() - b.Center()).norm());
    farthest = std::max(farthest, a.UnitRotation().angularDistance(b.UnitRotation()));
  }
  EXPECT_LT(farthest, 1e-7);
  std::map<uint64_t, Eigen::Vector3d> points;
  for (const Point3D& point : theirs.points) points[point.id] = point.position;
  ASSERT_EQ(points.size(), ours.points.size());
  farthest = 0;
  for (const Point3D& point : ours.points) {
    farthest = std::max(farthest, (point.position - points.at(point.id)).norm());
  }
  EXPECT_LT(farthest, 1e-9);
}

TEST(ModelTransform, RigsStayWithTheirImages) {
  const TempFolder temp;
  Reconstruction model = SmallModel(/*with_rigs=*/true);
  TransformReconstruction(kTransform, &model);
  WriteReconstruction(temp / "moved", model, ModelFormat::kText);
  // Its reader holds the poses of rigs, frames and images against each other.
  EXPECT_EQ(ReadReconstruction(temp / "moved").images.size(), 3u);
}

TEST(ModelTransform, TheIdentityKeepsEveryByte) {
  const TempFolder temp;
  Reconstruction model = SmallModel(/*with_rigs=*/true);
  WriteReconstruction(temp / "before", model, ModelFormat::kBinary);
  TransformReconstruction({}, &model);
  WriteReconstruction(temp / "after", model, ModelFormat::kBinary);
  for (const char* name : {"images.bin", "points3D.bin", "frames.bin", "rigs.bin"}) {
    EXPECT_EQ(ReadFile(temp / "before" / name), ReadFile(temp / "after" / name)) << name;
  }
}

}  // namespace
}  // namespace semfoam
