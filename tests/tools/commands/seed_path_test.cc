// SPDX-License-Identifier: GPL-3.0-or-later
//
// Trainings that start from a dense point cloud.
#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"

#include <algorithm>
#include <csignal>
#include <sstream>

#include "tests/tools/stopped_training.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::HasSubstr;
using testing::Not;

// Many points around each SfM point of the tabletop, in its colour, in reverse order if asked for.
std::string CloudOfTabletop(int copies, bool reversed = false) {
  std::vector<std::string> lines;
  for (const Point3D& point : ReadReconstruction(kTabletop / "sparse/0").points) {
    for (int i = 0; i < copies; ++i) {
      std::ostringstream line;
      line.precision(17);
      for (int axis = 0; axis < 3; ++axis) {
        line << point.position[axis] + 0.01 * ((i >> axis & 1) - 0.5 + 0.1 * i) << " ";
      }
      for (int c = 0; c < 3; ++c) line << static_cast<int>(point.color[c]) << (c < 2 ? " " : "\n");
      lines.push_back(line.str());
    }
  }
  if (reversed) std::reverse(lines.begin(), lines.end());
  std::string ply = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(lines.size()) +
                    "\nproperty double x\nproperty double y\nproperty double z\nproperty uchar "
                    "red\nproperty uchar green\nproperty uchar blue\nend_header\n";
  for (const std::string& line : lines) ply += line;
  return ply;
}

class SeedPath : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    WriteFile(Cloud(), CloudOfTabletop(8));
    const Outcome outcome = RunSemfoam(Trainer(kTabletop, *folder_ / "whole", WithCloud()));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    log_ = outcome.err;
    foam_ = ReadFile(*folder_ / "whole/scene.foam");
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static fs::path Cloud() { return *folder_ / "fused.ply"; }
  static std::vector<std::string> WithCloud(std::vector<std::string> more = {},
                                            const fs::path& cloud = Cloud()) {
    more.insert(more.end(),
                {"--seed_path",
                 cloud.string(),
                 "--FoamTraining.initial_sites",
                 "300",
                 "--FoamTraining.final_sites",
                 "3000"});
    return more;
  }

  static inline TempFolder* folder_ = nullptr;
  static inline std::string log_;
  static inline std::string foam_;
};

TEST_F(SeedPath, IsReported) {
  EXPECT_THAT(log_, HasSubstr(" points of " + Cloud().string() + ", thinned to 1"));
  EXPECT_THAT(log_, Not(HasSubstr("grey")));
}

// Neither the order of the points, nor the number of threads, nor how the option is given.
TEST_F(SeedPath, GivesTheSameBytes) {
  const TempFolder folder;
  WriteFile(folder / "moved.ply", CloudOfTabletop(8, /*reversed=*/true));
  const Outcome moved = RunSemfoam(Trainer(
      kTabletop, folder / "moved", WithCloud({"--num_threads", "3"}, folder / "moved.ply")));
  EXPECT_EQ(moved.exit_code, 0) << moved.err;
  EXPECT_TRUE(ReadFile(folder / "moved/scene.foam") == foam_);

  WriteFile(folder / "x.ini",
            "seed_path = " + Cloud().string() +
                "\n[FoamTraining]\ninitial_sites = 300\nfinal_sites = 3000\n");
  const Outcome from_file = RunSemfoam(TinyTraining(TrainerOn(kTabletop,
                                                              folder / "file",
                                                              {"--test_every",
                                                               "8",
                                                               "--project_path",
                                                               (folder / "x.ini").string(),
                                                               "--FoamTraining.num_rays",
                                                               "50000",
                                                               "--FoamTraining.final_sites",
                                                               "3000"})));
  EXPECT_EQ(from_file.exit_code, 0) << from_file.err;
  EXPECT_TRUE(ReadFile(folder / "file/scene.foam") == foam_);
}

TEST_F(SeedPath, IsPartOfARunThatGoesOn) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  Running running(Trainer(kTabletop, output, WithCloud({"--checkpoint_every", "0.001"})));
  ASSERT_TRUE(running.WaitUntil([&] { return CheckpointsIn(output).size() == 2; }));
  EXPECT_EQ(running.End(SIGKILL).exit_code, 128 + SIGKILL);
  const std::string newest = CheckpointsIn(output).back().string();

  const Mistake other = {newest, {"resume"}, "a run with another dense point cloud"};
  WriteFile(folder / "other.ply", CloudOfTabletop(7));
  ExpectRefused(
      RunSemfoam(Trainer(kTabletop, output, WithCloud({"--resume", "1"}, folder / "other.ply"))),
      other);
  ExpectRefused(RunSemfoam(Trainer(kTabletop,
                                   output,
                                   {"--resume",
                                    "1",
                                    "--FoamTraining.initial_sites",
                                    "300",
                                    "--FoamTraining.final_sites",
                                    "3000"})),
                other);
  // The same points elsewhere are the same.
  WriteFile(folder / "same.ply", CloudOfTabletop(8));
  const Outcome resumed =
      RunSemfoam(Trainer(kTabletop, output, WithCloud({"--resume", "1"}, folder / "same.ply")));
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("Going on from"));
  EXPECT_TRUE(ReadFile(output / "scene.foam") == foam_);
}

TEST_F(SeedPath, IsNotWrittenOver) {
  const TempFolder folder;
  const fs::path cloud = folder / "out/objects/7_mug.ply";
  fs::create_directories(cloud.parent_path());
  WriteFile(cloud, CloudOfTabletop(1));
  for (const char* command : {"foam_trainer", "automatic_segmenter"}) {
    std::vector<std::string> arguments = {command,
                                          "--output_path",
                                          (folder / "out").string(),
                                          "--overwrite",
                                          "1",
                                          "--seed_path",
                                          cloud.string(),
                                          "--image_path",
                                          (kTabletop / "images").string(),
                                          "--input_path",
                                          (kTabletop / "sparse/0").string()};
    if (command == std::string("automatic_segmenter")) {
      arguments.insert(arguments.end(), {"--workspace_path", kTabletop.string()});
    }
    ExpectRefused(RunSemfoam(arguments),
                  {cloud.string(), {"output_path"}, "is read, so it will not be written"});
    EXPECT_THAT(FilesBelow(folder / "out"), testing::ElementsAre("objects/7_mug.ply"));
  }
}

TEST_F(SeedPath, IsRefusedBeforeAnythingIsWritten) {
  const TempFolder folder;
  WriteFile(folder / "none.ply", "no PLY");
  const std::string cut = CloudOfTabletop(1);
  WriteFile(folder / "cut.ply", cut.substr(0, cut.size() / 2));
  ExpectEachRefused(Trainer(kTabletop, folder / "out"),
                    {{{"--seed_path", (folder / "missing.ply").string()},
                      {(folder / "missing.ply").string(), {}, "no such file"}},
                     {{"--seed_path", (folder / "none.ply").string()},
                      {(folder / "none.ply").string(), {}, "is no PLY file"}},
                     {{"--seed_path", (folder / "cut.ply").string()},
                      {(folder / "cut.ply").string(), {}, "ends too early"}}},
                    folder / "out");
}

}  // namespace
}  // namespace semfoam
