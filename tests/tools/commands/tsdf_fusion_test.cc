// SPDX-License-Identifier: GPL-3.0-or-later
//
// The program tsdf_fusion, on a ball whose surface is known.
#include "foam/model/model.h"

#include <fstream>
#include <sstream>
#include <string>

#include "tests/tools/commands/ring_scene.h"
#include "tests/tools/program.h"
#include <Eigen/Core>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

TEST(TsdfFusion, FindsTheSurfaceWherePhotosShowIt) {
  const TempFolder folder;
  WriteModel(folder / "scene.foam", RingScene());
  const Outcome outcome = RunProgram(
      SEMFOAM_TSDF_FUSION, {(folder / "scene.foam").string(), (folder / "out").string(), "60"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  std::ifstream file(folder / "out/12_ball.obj");
  int vertices = 0, near = 0, faces = 0, below = 0;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string kind;
    Eigen::Vector3d place;
    words >> kind;
    faces += kind == "f";
    if (kind != "v") continue;
    words >> place.x() >> place.y() >> place.z();
    place = (place - Eigen::Vector3d(5, 0, 0)) / 10;
    ++vertices;
    // Cells are 0.1 across.
    near += std::abs(place.norm() - kBallRadius) < 0.05;
    below += place.z() < -0.15;
  }
  EXPECT_GT(faces, 200);
  EXPECT_GT(near, 0.8 * vertices);
  EXPECT_LT(below, 0.02 * vertices) << "no photo shows the underside";
}

TEST(TsdfFusion, TellsItsUsage) {
  const Outcome outcome = RunProgram(SEMFOAM_TSDF_FUSION, {"scene.foam"});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.err, "Usage: tsdf_fusion SCENE.foam OUT [VOXELS, 10 to 1000]\n");
}

}  // namespace
}  // namespace semfoam
