// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/model_transform.h"

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
  std::ostringstream matrix;
  matrix.precision(17);
  for (int row = 0; row < 3; ++row) {
    matrix << kTransform.scale * kTransform.rotation.row(row) << " " << kTransform.translation[row]
           << "\n";
  }
  matrix << "0 0 0 1\n";
  WriteFile(temp / "transform.txt", matrix.str());
  const std::filesystem::path input = SEMFOAM_TEST_DATA "/tabletop/sparse/0";
  RunColmap(temp,
            "model_transformer",
            input,
            temp / "moved",
            "--transform_path '" + (temp / "transform.txt").string() + "'");
  const Reconstruction theirs = ReadReconstruction(temp / "moved");
  Reconstruction ours = ReadReconstruction(input);
  TransformReconstruction(kTransform, &ours);
  ASSERT_EQ(theirs.images.size(), ours.images.size());
  for (size_t i = 0; i < ours.images.size(); ++i) {
    const Pose &a = ours.images[i].cam_from_world, &b = theirs.images[i].cam_from_world;
    EXPECT_LT((a.Center() - b.Center()).norm(), 1e-9);
    EXPECT_LT((a.UnitRotation().toRotationMatrix() - b.UnitRotation().toRotationMatrix()).norm(),
              1e-9);
  }
  ASSERT_EQ(theirs.points.size(), ours.points.size());
  for (size_t i = 0; i < ours.points.size(); ++i) {
    EXPECT_LT((ours.points[i].position - theirs.points[i].position).norm(), 1e-9);
  }
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
