// SPDX-License-Identifier: GPL-3.0-or-later
//
// What a training keeps in its folder, and what it refuses to go on with.
#include "foam/checkpoint.h"

#include <csignal>
#include <set>

#include "tests/tools/stopped_training.h"

namespace semfoam {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

using TrainingFolder = StoppedTraining;

// Of an interrupted run's inputs and options, each that matters is named.
TEST_F(TrainingFolder, RefusesAnotherRun) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  CopyStopped(output);
  const auto before = FilesBelow(output);
  const auto refusal = [&](const fs::path& workspace, std::vector<std::string> more) {
    more.insert(more.end(), {"--resume", "1"});
    const Outcome outcome = RunSemfoam(Trainer(workspace, output, more));
    EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
    EXPECT_EQ(outcome.Errors().size(), 1u) << outcome.err;
    return outcome.Errors().empty() ? "" : outcome.Errors()[0];
  };
  EXPECT_THAT(refusal(Workspace(), {"--quality", "medium"}),
              HasSubstr("--quality low, not medium"));
  EXPECT_THAT(refusal(Workspace(), {"--FoamTraining.num_rays", "90000"}),
              HasSubstr("--FoamTraining.num_rays 50000, not 90000"));
  EXPECT_THAT(refusal(Workspace(), {"--FoamTraining.max_image_size", "100"}),
              HasSubstr("--FoamTraining.max_image_size -1, not 100"));
  EXPECT_THAT(refusal(Workspace(), {"--Effects.exposure", "on"}),
              HasSubstr("--Effects.exposure auto, not on"));
  EXPECT_THAT(refusal(Workspace(), {"--random_seed", "3"}), HasSubstr("--random_seed 0, not 3"));

  const auto with = [&](const std::string& name,
                        const std::function<void(const fs::path&)>& change) {
    const fs::path workspace = folder / name;
    CopyTabletop(workspace);
    change(workspace);
    return refusal(workspace, {});
  };
  const auto swap = [](const fs::path& a, const fs::path& b) {
    const std::string bytes = ReadFile(a);
    WriteFile(a, ReadFile(b));
    WriteFile(b, bytes);
  };
  const auto first_two = [](const fs::path& below) {
    std::vector<std::string> files = FilesBelow(below);
    std::sort(files.begin(), files.end());
    return std::pair(below / files[0], below / files[1]);
  };
  EXPECT_THAT(with("photos",
                   [&](const fs::path& workspace) {
                     const auto [a, b] = first_two(workspace / "images");
                     swap(a, b);
                   }),
              HasSubstr("a run with other photos"));
  EXPECT_THAT(with("masks",
                   [&](const fs::path& workspace) {
                     const auto [a, b] = first_two(workspace / "object_mask");
                     swap(a, b);
                   }),
              HasSubstr("a run with other masks"));
  EXPECT_THAT(with("names",
                   [&](const fs::path& workspace) {
                     WriteFile(workspace / "labels.json", R"({"labels": {"6": "cup"}})");
                   }),
              HasSubstr("a run with other masks"));
  EXPECT_THAT(with("model",
                   [&](const fs::path& workspace) {
                     // The last byte of a point's colour or of a track; the file stays readable.
                     fs::path file = workspace / "sparse/0/cameras.bin";
                     std::string bytes = ReadFile(file);
                     bytes[bytes.size() - 4] ^= 1;
                     WriteFile(file, bytes);
                   }),
              HasSubstr("a run with another COLMAP model"));
  // Nothing of the stopped run was touched by all that.
  EXPECT_THAT(FilesBelow(output), ::testing::UnorderedElementsAreArray(before));

  // What training does not look at may differ.
  const fs::path moved = folder / "moved";
  CopyTabletop(moved);
  fs::copy_file(first_two(moved / "images").first, moved / "images" / "zzz unregistered.jpg");
  const Outcome resumed = RunSemfoam(Trainer(moved, output, {"--resume", "1"}));
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  ExpectWhole(output);
}

// As if a graphics card had made the checkpoint; said before photos are read.
TEST_F(TrainingFolder, RefusesAnotherKindOfDevice) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  CopyStopped(output);
  const fs::path newest = CheckpointsIn(output).back();
  CheckpointContents contents;
  for (const char* group : {"inputs", "options", "state"}) {
    contents.texts[group] = Checkpoint(newest).Texts(group);
  }
  EXPECT_EQ(contents.texts["state"]["device"], "cpu");
  contents.texts["state"]["device"] = "cuda";
  WriteCheckpoint(newest, contents);
  const Outcome outcome = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.Errors(),
              ElementsAre("ERROR: " + newest.string() +
                          ": this checkpoint was made on a graphics card, and gone on with on the "
                          "machine's cores the run would end with other bytes; --device cuda:0, "
                          "or another card, or training from the beginning, would be right."));
  EXPECT_THAT(outcome.err, ::testing::Not(HasSubstr("Loading")));
}

TEST_F(TrainingFolder, KeepsTwoCheckpointsAndNoneWhereNoneAreWanted) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  Running running(SavingTrainer(Workspace(), output));
  size_t most = 0;
  std::set<std::string> seen;
  running.WaitUntil([&] {
    const auto checkpoints = CheckpointsIn(output);
    most = std::max(most, checkpoints.size());
    for (const fs::path& path : checkpoints) seen.insert(path.filename().string());
    return seen.size() >= 10;
  });
  running.End(SIGKILL);
  EXPECT_GE(seen.size(), 10u);
  EXPECT_LE(most, 3u);  // two, and the newest for the moment until the oldest is removed

  Running without(Trainer(Workspace(), folder / "none", {"--checkpoint_every", "0"}));
  size_t written = 0;
  EXPECT_FALSE(without.WaitUntil([&] {
    written = std::max(written, CheckpointsIn(folder / "none").size());
    return false;
  }));
  EXPECT_EQ(without.End(SIGKILL).exit_code, 0);
  EXPECT_EQ(written, 0u);
  ExpectWhole(folder / "none");
}

TEST_F(TrainingFolder, ASignalLeavesACheckpointEvenWhereNoneAreWanted) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  Running running(Trainer(Workspace(), output, {"--checkpoint_every", "0"}));
  ASSERT_TRUE(running.WaitUntil([&] { return fs::exists(output / "checkpoints"); }));
  const Outcome stopped = running.End(SIGINT);
  EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
  EXPECT_EQ(CheckpointsIn(output).size(), 1u);
  const Outcome resumed = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("Going on from"));
  ExpectWhole(output);
}

TEST_F(TrainingFolder, OneProcessAtATimeWritesIntoAFolder) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  fs::copy(Whole(), output, fs::copy_options::recursive);
  Running running(SavingTrainer(Workspace(), output));
  ASSERT_TRUE(running.WaitUntil([&] { return !CheckpointsIn(output).empty(); }));
  const std::string foam_path = (Whole() / "scene.foam").string();
  const std::vector<std::string> others[] = {
      Trainer(Workspace(), output),
      Trainer(Workspace(), output, {"--resume", "1"}),
      TinyTraining({"automatic_segmenter",
                    "--workspace_path",
                    Workspace().string(),
                    "--output_path",
                    output.string()}),
      {"volume_exporter", "--foam_path", foam_path, "--output_path", output.string()},
      {"mesh_exporter", "--foam_path", foam_path, "--output_path", output.string()}};
  for (const auto& other : others) {
    const Outcome refused = RunSemfoam(other);
    EXPECT_EQ(refused.exit_code, 1) << other[0];
    EXPECT_THAT(refused.Errors(),
                ElementsAre("ERROR: " + output.string() +
                            ": another process is writing into this folder; wait for its end, or "
                            "choose another."));
  }
  // Who only reads is not hindered.
  EXPECT_EQ(
      RunSemfoam({"foam_analyzer", "--foam_path", (output / "scene.foam").string()}).exit_code, 0);
  running.End(SIGKILL);
  const Outcome next = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  EXPECT_EQ(next.exit_code, 0) << next.err;
  ExpectWhole(output);
}

TEST_F(TrainingFolder, RefusesBadValues) {
  const TempFolder folder;
  const auto error = [&](const std::string& name, const std::string& value) {
    std::vector<std::string> arguments = Trainer(Workspace(), folder / "out");
    arguments.insert(arguments.end(), {name, value});
    const Outcome outcome = RunSemfoam(arguments);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_EQ(outcome.Errors().size(), 1u) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(error("--checkpoint_every", "-1"), HasSubstr("--checkpoint_every is -1"));
  EXPECT_THAT(error("--checkpoint_every", "often"), HasSubstr("it takes a number"));
  EXPECT_THAT(error("--resume", "2"), HasSubstr("it takes 0, 1, true or false"));
  EXPECT_FALSE(fs::exists(folder / "out"));
}

}  // namespace
}  // namespace semfoam
