// SPDX-License-Identifier: GPL-3.0-or-later
//
// What a training keeps in its folder, and what it refuses to go on with.
#include "foam/train/checkpoint.h"

#include <csignal>
#include <map>
#include <set>

#include "tests/tools/stopped_training.h"
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

using TrainingFolder = StoppedTraining;

std::map<std::string, std::string> BytesBelow(const fs::path& folder) {
  std::map<std::string, std::string> bytes;
  for (const std::string& file : FilesBelow(folder)) bytes[file] = ReadFile(folder / file);
  return bytes;
}

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
  EXPECT_THAT(refusal(Workspace(), {"--quality", "medium"}), HasSubstr("quality low, not medium"));
  EXPECT_THAT(refusal(Workspace(), {"--FoamTraining.num_rays", "90000"}),
              HasSubstr("num_rays 50000, not 90000"));
  EXPECT_THAT(refusal(Workspace(), {"--FoamTraining.max_image_size", "100"}),
              HasSubstr("max_image_size -1, not 100"));
  EXPECT_THAT(refusal(Workspace(), {"--Effects.exposure", "on"}),
              HasSubstr("exposure auto, not on"));
  EXPECT_THAT(refusal(Workspace(), {"--random_seed", "3"}), HasSubstr("random_seed 0, not 3"));

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

// As if a GPU had made the checkpoint; said before photos are read.
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
  ExpectRefused(outcome, {newest.string(), {"device", "cuda:0"}, "made on a GPU"});
  EXPECT_THAT(outcome.err, Not(HasSubstr("Loading")));
}

// The file as another version of the format.
void ChangeVersion(const fs::path& path, uint32_t version) {
  std::string bytes = ReadFile(path);
  bytes.replace(8, sizeof(version), reinterpret_cast<const char*>(&version), sizeof(version));
  WriteFile(path, bytes);
}

// Whatever is there was written by somebody, and may be worth hours.
TEST_F(TrainingFolder, StopsAtCheckpointsOfAnotherVersion) {
  for (const uint32_t version : {0u, kCheckpointVersion + 1}) {
    const TempFolder folder;
    const fs::path output = folder / "out";
    CopyStopped(output);
    const std::vector<fs::path> checkpoints = CheckpointsIn(output);
    for (const fs::path& path : checkpoints) ChangeVersion(path, version);
    const auto before = BytesBelow(output);
    const Outcome outcome = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
    ExpectRefused(
        outcome,
        {checkpoints.back().string(),
         {"version " + std::to_string(version), "version " + std::to_string(kCheckpointVersion)},
         "format version"});
    EXPECT_THAT(outcome.err, Not(HasSubstr("Loading")));
    EXPECT_TRUE(BytesBelow(output) == before);

    // Training from the beginning keeps them, too.
    const Outcome stopped = TrainAndStop(Workspace(), output, SIGINT);
    EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
    for (const fs::path& path : checkpoints) {
      EXPECT_EQ(ReadFile(output / "checkpoints/replaced" / path.filename()),
                before.at("checkpoints/" + path.filename().string()));
    }
  }
}

TEST_F(TrainingFolder, StopsAtATrainedFoamsCheckpointOfAnotherVersion) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  fs::copy(Whole(), output, fs::copy_options::recursive);
  CheckpointContents contents;
  fs::create_directory(output / "checkpoints");
  WriteCheckpoint(output / "checkpoints/trained.ckpt", contents);
  ChangeVersion(output / "checkpoints/trained.ckpt", kCheckpointVersion + 1);
  const auto before = BytesBelow(output);
  const Outcome outcome = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  EXPECT_EQ(outcome.exit_code, 1);
  ASSERT_EQ(outcome.Errors().size(), 1u) << outcome.err;
  EXPECT_THAT(outcome.Errors()[0],
              HasSubstr("trained.ckpt: this checkpoint has format version " +
                        std::to_string(kCheckpointVersion + 1)));
  EXPECT_TRUE(BytesBelow(output) == before);

  // A damaged one says nothing of how the run ends, but the foam is there.
  WriteFile(output / "checkpoints/trained.ckpt", "damaged");
  const Outcome damaged = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  ExpectRefused(damaged,
                {(output / "scene.foam").string(),
                 {"holds a trained foam", (output / "checkpoints").string(), "overwrite"},
                 "no whole checkpoint"});
  EXPECT_EQ(ReadFile(output / "scene.foam"), before.at("scene.foam"));
  EXPECT_EQ(ReadFile(output / "checkpoints/trained.ckpt"), "damaged");
}

TEST_F(TrainingFolder, StopsWhereACheckpointCannotBeRead) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  CopyStopped(output);
  const std::vector<fs::path> checkpoints = CheckpointsIn(output);
  fs::remove(checkpoints.back());
  // The kernel gives EIO at its beginning, as for a block that a disk has lost.
  fs::create_symlink("/proc/self/mem", checkpoints.back());
  const Outcome outcome = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  ExpectRefused(outcome, {checkpoints.back().string(), {"Input/output error"}, "cannot be read"});
  EXPECT_TRUE(fs::is_symlink(checkpoints.back()));
  EXPECT_THAT(CheckpointsIn(output), ::testing::ElementsAreArray(checkpoints));
}

TEST_F(TrainingFolder, MovesDamagedCheckpointsAsideUntilItsEnd) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  CopyStopped(output);
  const std::vector<fs::path> checkpoints = CheckpointsIn(output);
  WriteFile(checkpoints.back(), "damaged");
  const fs::path aside = output / "checkpoints/damaged" / checkpoints.back().filename();
  std::vector<std::string> resume = SavingTrainer(Workspace(), output);
  resume.insert(resume.end(), {"--resume", "1"});
  {
    Running running(resume);
    ASSERT_TRUE(running.WaitUntil([&] { return fs::exists(aside); }));
    const Outcome stopped = running.End(SIGINT);
    EXPECT_THAT(stopped.err,
                HasSubstr("WARNING: " + checkpoints.back().string() +
                          " is not whole: it is moved to " + aside.string()));
  }
  EXPECT_EQ(ReadFile(aside), "damaged");
  // A second one of the same name.
  const fs::path newest = CheckpointsIn(output).back();
  fs::rename(newest, newest.parent_path() / checkpoints.back().filename());
  WriteFile(newest.parent_path() / checkpoints.back().filename(), "damaged, too");
  const Outcome whole = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  EXPECT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_THAT(
      whole.err,
      HasSubstr("is moved to " + (aside.parent_path() / aside.stem()).string() + "_2.ckpt"));
  EXPECT_THAT(
      whole.err,
      HasSubstr("Removed the older checkpoints in " + (output / "checkpoints/damaged").string()));
  ExpectWhole(output);
}

// What a first run had reached is not lost by the third.
TEST_F(TrainingFolder, KeepsTheCheckpointsOfEveryRunThatWasReplaced) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  CopyStopped(output);
  const auto first = CheckpointsIn(output);
  TrainAndStop(Workspace(), output, SIGINT);
  const auto second = CheckpointsIn(output);
  Running running(SavingTrainer(Workspace(), output));
  ASSERT_TRUE(running.WaitUntil(
      [&] { return fs::exists(output / "checkpoints/replaced_2" / second.back().filename()); }));
  const Outcome stopped = running.End(SIGINT);
  EXPECT_THAT(stopped.err, HasSubstr((output / "checkpoints/replaced_2").string()));
  for (const fs::path& path : first) {
    EXPECT_TRUE(fs::exists(output / "checkpoints/replaced" / path.filename())) << path;
  }
  const Outcome whole = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  EXPECT_EQ(whole.exit_code, 0) << whole.err;
  ExpectWhole(output);
}

TEST_F(TrainingFolder, LeavesFilesThatAreNoneOfItsOwn) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  CopyStopped(output);
  WriteFile(output / "checkpoints/notes.txt", "mine");
  WriteFile(output / "checkpoints/007.ckpt", "mine");
  const Outcome outcome = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("WARNING: " + (output / "checkpoints").string() + " holds"));
  EXPECT_THAT(FilesBelow(output / "checkpoints"),
              ::testing::UnorderedElementsAre("notes.txt", "007.ckpt"));
}

// What a run leaves that is killed between the renaming of trained.ckpt and the removal of the
// folder that it was written in.
TEST_F(TrainingFolder, FinishesDespiteTheScratchFolderOfAKilledRun) {
  const TempFolder folder;
  const fs::path output = folder / "out";
  std::vector<std::string> segmenter =
      Trainer(Workspace(), output, {"--formats", "ply", "--workspace_path", Workspace().string()});
  segmenter[0] = "automatic_segmenter";
  {
    Running running(segmenter);
    ASSERT_TRUE(running.WaitUntil([&] { return fs::exists(output / "checkpoints/trained.ckpt"); }));
    running.End(SIGKILL);
  }
  ASSERT_TRUE(fs::exists(output / "checkpoints/trained.ckpt")) << "too late to be a test";
  const fs::path scratch = output / "checkpoints/.semfoam-tmp-1-0";
  fs::create_directories(scratch);
  WriteFile(scratch / "trained.ckpt", "half");
  segmenter.insert(segmenter.end(), {"--resume", "1"});
  const Outcome outcome = RunSemfoam(segmenter);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("Training is done already"));
  EXPECT_FALSE(fs::exists(output / "checkpoints")) << outcome.err;
}

// What a stopped run says that it can be gone on from is there.
TEST_F(TrainingFolder, SaysWhichCheckpointCouldBeWritten) {
  const TempFolder folder;
  {
    const fs::path output = folder / "none";
    Running running(Trainer(Workspace(), output));
    running.LimitFileSize(100'000);
    ASSERT_TRUE(running.WaitUntil([&] { return fs::exists(output / "checkpoints"); }));
    const Outcome stopped = running.End(SIGTERM);
    EXPECT_EQ(stopped.exit_code, 143) << stopped.err;
    EXPECT_THAT(CheckpointsIn(output), ::testing::IsEmpty());
    EXPECT_THAT(stopped.err, HasSubstr("There is no checkpoint of iteration"));
    EXPECT_THAT(stopped.err,
                HasSubstr("No checkpoint could be written, so there is nothing to go on from."));
    EXPECT_THAT(stopped.err, Not(HasSubstr("--resume")));
  }
  const fs::path output = folder / "older";
  Running running(SavingTrainer(Workspace(), output));
  ASSERT_TRUE(running.WaitUntil([&] { return CheckpointsIn(output).size() == 2; }));
  running.LimitFileSize(100'000);
  const auto failed = [&] {
    return running.Log().find("There is no checkpoint of iteration") != std::string::npos;
  };
  ASSERT_TRUE(running.WaitUntil(failed));
  const Outcome stopped = running.End(SIGINT);
  EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
  const auto checkpoints = CheckpointsIn(output);
  ASSERT_FALSE(checkpoints.empty());
  EXPECT_THAT(stopped.err,
              HasSubstr(". The newest checkpoint is of iteration " +
                        checkpoints.back().stem().string() + "; to go on from it: "));
  EXPECT_THAT(stopped.err, Not(HasSubstr("To go on from there")));
  const Outcome whole = RunSemfoam(Trainer(Workspace(), output, {"--resume", "1"}));
  EXPECT_EQ(whole.exit_code, 0) << whole.err;
  EXPECT_THAT(whole.err, HasSubstr("Going on from " + checkpoints.back().string()));
  ExpectWhole(output);
}

// A finished training, with its exports.
class TrainingFolderFinished : public StoppedTraining {
 protected:
  void SetUp() override {
    fs::copy(Whole(), output_, fs::copy_options::recursive);
    for (const std::string command : {"volume_exporter", "mesh_exporter"}) {
      std::vector<std::string> arguments = {command,
                                            "--foam_path",
                                            (output_ / "scene.foam").string(),
                                            "--output_path",
                                            output_.string()};
      if (command == "volume_exporter")
        arguments.insert(arguments.end(), {"--max_resolution", "16"});
      const Outcome outcome = RunSemfoam(arguments);
      ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    }
    WriteFile(output_ / "notes.txt", "mine");
    WriteFile(output_ / "objects/mine.ply", "mine");
  }

  const TempFolder temp_;
  const fs::path output_ = temp_ / "out";
};

TEST_F(TrainingFolderFinished, IsReplacedOnlyWhereThatIsAskedFor) {
  const auto before = BytesBelow(output_);
  const Mistake replaces = {
      (output_ / "scene.foam").string(), {"overwrite", "output_path"}, "holds a trained foam"};
  const Outcome trainer = RunSemfoam(Trainer(Workspace(), output_));
  std::vector<std::string> segmenter = Trainer(Workspace(), output_);
  segmenter[0] = "automatic_segmenter";
  segmenter.insert(segmenter.end(), {"--workspace_path", Workspace().string()});
  for (const Outcome& outcome : {trainer, RunSemfoam(segmenter)}) {
    ExpectRefused(outcome, replaces);
    // Before any photo, mask or model was read.
    EXPECT_THAT(outcome.err, Not(HasSubstr("photos")));
  }
  EXPECT_TRUE(BytesBelow(output_) == before);

  // A run that ends before its foam is written has replaced nothing.
  std::vector<std::string> other = SavingTrainer(Workspace(), output_);
  other.insert(other.end(), {"--overwrite", "1", "--random_seed", "5"});
  {
    Running running(other);
    ASSERT_TRUE(running.WaitUntil([&] { return CheckpointsIn(output_).size() == 2; }));
    const Outcome stopped = running.End(SIGINT);
    EXPECT_THAT(stopped.err, HasSubstr("--overwrite 1"));  // in the command that goes on
  }
  for (const auto& [file, bytes] : before) EXPECT_EQ(ReadFile(output_ / file), bytes) << file;
  // It is gone on with, and not begun anew without a word.
  const Outcome again = RunSemfoam(Trainer(Workspace(), output_, {"--random_seed", "5"}));
  EXPECT_EQ(again.exit_code, 1);
  ASSERT_EQ(again.Errors().size(), 1u);
  EXPECT_THAT(again.Errors()[0], HasSubstr("holds a trained foam; --resume 1 to go on with"));
}

TEST_F(TrainingFolderFinished, HoldsFilesOfOneFoam) {
  const auto before = BytesBelow(output_);
  std::vector<std::string> other =
      Trainer(Workspace(), output_, {"--overwrite", "1", "--random_seed", "5"});
  // Without held-out views there is no plot.
  *(std::find(other.begin(), other.end(), "--test_every") + 1) = "0";
  const Outcome outcome = RunSemfoam(other);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto labels = nlohmann::json::parse(ReadFile(output_ / "labels.json"));
  EXPECT_EQ(labels["source_model_xxh64"], ChecksumOf(output_ / "scene.foam"));
  EXPECT_EQ(labels["files"], nlohmann::json::object());
  for (const auto& object : labels["objects"]) {
    EXPECT_EQ(object["files"], nlohmann::json::object());
  }
  EXPECT_FALSE(ReadFile(output_ / "scene.foam") == before.at("scene.foam"));
  // Everything of the old foam is gone, and named; nothing of anybody else's.
  EXPECT_THAT(FilesBelow(output_),
              ::testing::UnorderedElementsAre("scene.foam",
                                              "labels.json",
                                              "effects.json",
                                              "training_log.csv",
                                              "notes.txt",
                                              "objects/mine.ply"));
  EXPECT_EQ(ReadFile(output_ / "objects/mine.ply"), "mine");
  for (const auto& [file, bytes] : before) {
    if (fs::exists(output_ / file)) continue;
    const fs::path path(file);
    EXPECT_THAT(outcome.err, HasSubstr((path.parent_path() / path.stem()).string())) << file;
  }
}

TEST_F(TrainingFolderFinished, TakesNoNewNamesWithoutAWord) {
  const auto before = BytesBelow(output_);
  const auto labels = nlohmann::json::parse(before.at("labels.json"));
  WriteFile(temp_ / "same.json", before.at("labels.json"));
  WriteFile(temp_ / "names.json", R"({"labels": {"1": "parquet"}})");
  const auto resume = [&](const std::string& names) {
    const Outcome outcome = RunSemfoam(Trainer(
        Workspace(), output_, {"--resume", "1", "--labels_path", (temp_ / names).string()}));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr("is finished"));
    EXPECT_TRUE(BytesBelow(output_) == before);
    return outcome.err;
  };
  EXPECT_THAT(resume("same.json"), Not(HasSubstr("WARNING")));
  EXPECT_THAT(resume("names.json"),
              HasSubstr("WARNING: A finished run takes no new names (1 is parquet): "));
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
  std::vector<std::string> overwrite = SavingTrainer(Workspace(), output);
  overwrite.insert(overwrite.end(), {"--overwrite", "1"});
  Running running(overwrite);
  ASSERT_TRUE(running.WaitUntil([&] { return !CheckpointsIn(output).empty(); }));
  running.Pause();  // So that it is still there after all others.
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
    ExpectRefused(refused, {output.string(), {}, "another process is writing"});
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
  EXPECT_THAT(error("--preview_every", "-1"), HasSubstr("--preview_every is -1"));
  EXPECT_THAT(error("--resume", "2"), HasSubstr("it takes 0, 1, true or false"));
  EXPECT_FALSE(fs::exists(folder / "out"));
}

}  // namespace
}  // namespace semfoam
