// SPDX-License-Identifier: GPL-3.0-or-later
//
// mesh_exporter and volume_exporter with --blocks_path.
#include "foam/train/block_checkpoint.h"

#include <filesystem>
#include <memory>

#include "tests/export/blocks/street_foam.h"
#include "tests/tools/block_jobs.h"
#include "tests/tools/street_blocks.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::UnorderedElementsAreArray;

std::vector<std::string> Exporter(const std::string& command,
                                  const std::vector<std::string>& input,
                                  const fs::path& output,
                                  const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments = {command};
  arguments.insert(arguments.end(), input.begin(), input.end());
  arguments.insert(arguments.end(), {"--output_path", output.string()});
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

// Expects the objects of two labels.json to be the same, but for the order of sums.
void ExpectSameObjects(const fs::path& by_block, const fs::path& whole) {
  const auto a = nlohmann::json::parse(ReadFile(by_block / "labels.json"));
  const auto b = nlohmann::json::parse(ReadFile(whole / "labels.json"));
  ASSERT_EQ(a["objects"].size(), b["objects"].size());
  ASSERT_GT(b["objects"].size(), 0u);
  for (size_t k = 0; k < b["objects"].size(); ++k) {
    const nlohmann::json &made = a["objects"][k], &expected = b["objects"][k];
    SCOPED_TRACE(expected["name"]);
    for (const char* key : {"id", "name", "color", "cells", "pieces", "cavities", "genus"}) {
      EXPECT_EQ(made[key], expected[key]) << key;
    }
    for (const char* key : {"volume", "area", "confidence"}) {
      const auto value = expected[key].get<double>();
      EXPECT_NEAR(made[key].get<double>(), value, 1e-6 * value) << key;
    }
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(
          made["centroid"][axis].get<double>(), expected["centroid"][axis].get<double>(), 1e-6);
    }
    EXPECT_EQ(made["left_out"]["cells"], expected["left_out"]["cells"]);
  }
  EXPECT_EQ(a["labels"], b["labels"]);
  EXPECT_EQ(a["frame"], b["frame"]);
}

class BlockExports : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    const Model model = StreetFoam(6000, 1, 1500);
    WriteModel(FoamPath(), model);
    fs::create_directories(Blocks());
    WriteTrainedBlocks(Blocks(), model, 2, 2, 0.05f);
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static fs::path FoamPath() { return *folder_ / "scene.foam"; }
  static fs::path Blocks() { return *folder_ / "blocks"; }
  // A copy of the latter, to be spoilt.
  static fs::path CopyOfBlocks(const std::string& name) {
    const fs::path copy = *folder_ / name;
    fs::copy(Blocks(), copy, fs::copy_options::recursive);
    return copy;
  }
  static std::vector<std::string> Whole() { return {"--foam_path", FoamPath().string()}; }
  static std::vector<std::string> ByBlock(const fs::path& blocks = Blocks()) {
    return {"--blocks_path", blocks.string()};
  }

  static inline TempFolder* folder_ = nullptr;
};

// Polished blocks are read in place of those that are only trained, and make the foam that they
// were cut from.
TEST_F(BlockExports, OfPolishedBlocks) {
  const fs::path blocks = *folder_ / "polished", merged = *folder_ / "merged";
  const Model model = ReadModel(FoamPath());
  fs::create_directories(blocks);
  WriteTrainedBlocks(blocks, model, 2, 2, 0.05f, /*are_polished=*/true);
  WriteFile(blocks / "project.ini", "workspace_path=" + kTabletop.string() + "\nblocks=2x2\n");
  const Outcome outcome = Merge(blocks, merged);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Model joined = ReadModel(merged / "scene.foam");
  EXPECT_EQ(joined.foam.NumSites(), model.foam.NumSites());
  EXPECT_EQ(joined.foam.classifier_weight, model.foam.classifier_weight);
  EXPECT_EQ(joined.options, model.options);
  const std::string log = ReadFile(merged / "training_log.csv");
  // Of four blocks: the rays and seconds of the split, and four times what each has after it.
  EXPECT_THAT(log, HasSubstr("9.000,3,3000,6000"));

  const fs::path whole = *folder_ / "meshes of merged", output = *folder_ / "meshes of polished";
  const std::vector<std::string> options = {"--MeshExport.method", "cells", "--formats", "ply"};
  const Outcome expected = RunSemfoam(
      Exporter("mesh_exporter", {"--foam_path", (merged / "scene.foam").string()}, whole, options));
  ASSERT_EQ(expected.exit_code, 0) << expected.err;
  for (const char* name : {"00", "03"}) fs::remove(blocks / name / "block.ckpt");
  ExpectRefused(RunSemfoam(Exporter("mesh_exporter", ByBlock(blocks), output)),
                {"00/block.ckpt", {}, "not trained"});
  for (const char* name : {"00", "03"}) {
    fs::copy_file(Blocks() / name / "block.ckpt", blocks / name / "block.ckpt");
  }
  const Outcome by_block =
      RunSemfoam(Exporter("mesh_exporter", ByBlock(blocks), output, {"--formats", "ply"}));
  ASSERT_EQ(by_block.exit_code, 0) << by_block.err;
  ExpectSameObjects(output, whole);
  EXPECT_NE(nlohmann::json::parse(ReadFile(output / "labels.json"))["source_model_xxh64"],
            ChecksumOf(blocks / "run.foam"));
}

TEST_F(BlockExports, MeshesAreThoseOfTheWholeFoam) {
  const fs::path whole = *folder_ / "whole meshes", output = *folder_ / "meshes";
  const Outcome expected =
      RunSemfoam(Exporter("mesh_exporter", Whole(), whole, {"--MeshExport.method", "cells"}));
  ASSERT_EQ(expected.exit_code, 0) << expected.err;
  const Outcome outcome =
      RunSemfoam(Exporter("mesh_exporter", ByBlock(), output, {"--num_threads", "1"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  ExpectSameObjects(output, whole);
  // The wall is in all blocks along the street.
  EXPECT_THAT(outcome.err, HasSubstr("2_wall.om, .ply, .obj, .mtl, .glb"));
  EXPECT_THAT(outcome.err, HasSubstr("1 shell, no cavities"));
  // The same sizes in files without compression, whatever the order of the vertices.
  for (const char* file : {"objects/1_road.ply", "objects/2_wall.ply", "objects/3_house.ply"}) {
    EXPECT_EQ(fs::file_size(output / file), fs::file_size(whole / file)) << file;
  }
  EXPECT_TRUE(fs::exists(output / "scene.usda"));
  EXPECT_FALSE(fs::exists(output / "scene.glb"));
  for (const char* threads : {"2", "5"}) {
    const fs::path again = *folder_ / ("meshes of " + std::string(threads));
    const Outcome other =
        RunSemfoam(Exporter("mesh_exporter", ByBlock(), again, {"--num_threads", threads}));
    ASSERT_EQ(other.exit_code, 0) << other.err;
    EXPECT_THAT(FilesBelow(again), UnorderedElementsAreArray(FilesBelow(output)));
    for (const fs::path file : FilesBelow(output)) {
      EXPECT_TRUE(ReadFile(again / file) == ReadFile(output / file)) << file;
    }
  }
}

TEST_F(BlockExports, VolumesAreThoseOfTheWholeFoam) {
  const fs::path whole = *folder_ / "whole volumes", output = *folder_ / "volumes";
  const std::vector<std::string> coarse = {"--VolumeExport.max_resolution", "64"};
  const Outcome expected = RunSemfoam(Exporter("volume_exporter", Whole(), whole, coarse));
  ASSERT_EQ(expected.exit_code, 0) << expected.err;
  const Outcome outcome = RunSemfoam(Exporter("volume_exporter", ByBlock(), output, coarse));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  ExpectSameObjects(output, whole);
  EXPECT_THAT(FilesBelow(output), UnorderedElementsAreArray(FilesBelow(whole)));
  for (const fs::path file : FilesBelow(whole)) {
    const std::string line = file.string() + ": ";
    if (file.extension() != ".vdb") continue;
    const size_t at = expected.err.find(line);
    ASSERT_NE(at, std::string::npos) << file;
    const std::string summary = expected.err.substr(at, expected.err.find('\n', at) - at);
    EXPECT_THAT(outcome.err, HasSubstr(summary));
  }
}

TEST_F(BlockExports, WhatIsMissingCutForeignOrOlderIsRefused) {
  const auto expect_refused = [&](const fs::path& blocks, const Mistake& mistake) {
    const fs::path output = *folder_ / "refused";
    for (const char* command : {"mesh_exporter", "volume_exporter"}) {
      ExpectRefused(RunSemfoam(Exporter(command, ByBlock(blocks), output)), mistake);
      EXPECT_THAT(FilesBelow(output), IsEmpty());
    }
  };
  {
    const fs::path blocks = CopyOfBlocks("missing");
    fs::remove(blocks / "02/block.ckpt");
    expect_refused(blocks, {"02/block.ckpt", {}, "not trained"});
  }
  {
    const fs::path blocks = CopyOfBlocks("cut");
    const std::string bytes = ReadFile(blocks / "02/block.ckpt");
    WriteFile(blocks / "02/block.ckpt", bytes.substr(0, bytes.size() / 2));
    expect_refused(blocks, {"02/block.ckpt", {}, "cut or damaged"});
  }
  {
    const fs::path blocks = CopyOfBlocks("swapped");
    fs::copy_file(
        blocks / "01/block.ckpt", blocks / "02/block.ckpt", fs::copy_options::overwrite_existing);
    expect_refused(blocks, {"02/block.ckpt", {"01", "02"}, "training this block"});
  }
  {
    const fs::path blocks = CopyOfBlocks("foreign");
    const std::string json = ReadFile(blocks / "blocks.json");
    std::string other = json;
    other.replace(other.find("of a test"), 9, "another's");
    WriteFile(blocks / "blocks.json", other);
    expect_refused(blocks, {"00/block.ckpt", {}, "another split"});
  }
  {
    const fs::path blocks = CopyOfBlocks("run of another split");
    Model run = ReadModel(blocks / "run.foam");
    run.options["split"] = "another's";
    WriteModel(blocks / "run.foam", run);
    expect_refused(blocks, {"run.foam", {}, "not of the split"});
  }
  {
    const fs::path blocks = CopyOfBlocks("of an older version");
    fs::remove(blocks / "run.foam");
    expect_refused(blocks, {"run.foam", {}, "older version"});
  }
  expect_refused(*folder_ / "no blocks", {"blocks.json", {}, "no such file"});
}

TEST_F(BlockExports, OptionsThatNeedTheWholeFoamAreRefused) {
  const fs::path output = *folder_ / "refused";
  const auto expect_refused = [&](const std::string& command,
                                  const std::vector<std::string>& more,
                                  const Mistake& mistake) {
    ExpectRefused(RunSemfoam(Exporter(command, ByBlock(), output, more)), mistake);
    EXPECT_THAT(FilesBelow(output), IsEmpty());
  };
  expect_refused("mesh_exporter",
                 {"--MeshExport.method", "smooth"},
                 {"", {"MeshExport.method", "smooth"}, "cells"});
  expect_refused("mesh_exporter",
                 {"--MeshExport.target_faces", "1000"},
                 {"", {"MeshExport.target_faces"}, "merge them"});
  expect_refused("mesh_exporter",
                 {"--workspace_path", kTabletop.string()},
                 {"", {"workspace_path"}, "merge them"});
  expect_refused(
      "mesh_exporter", {"--foam_path", FoamPath().string()}, {"", {"foam_path"}, "blocks_path"});
  expect_refused("mesh_exporter", {"--level", "plane"}, {"", {"level"}, "merging"});
  expect_refused("mesh_exporter", {"--labels", "fence"}, {"", {"fence"}, "wall"});
  expect_refused("volume_exporter",
                 {"--VolumeExport.supersample", "2"},
                 {"", {"VolumeExport.supersample"}, "merge them"});
  expect_refused("volume_exporter",
                 {"--VolumeExport.points", "1"},
                 {"", {"VolumeExport.points"}, "merge them"});
  ExpectRefused(RunSemfoam({"mesh_exporter", "--blocks_path", Blocks().string()}),
                {"", {"output_path"}, "required"});
}

// Blocks of a training, held against the foam that they are joined to, before it is trained on.
TEST_F(BlockExports, OfATrainingAreThoseOfTheJoinedFoam) {
  const fs::path blocks = *folder_ / "trained";
  const Outcome split = RunSemfoam(Splitter(blocks, "2x2"));
  ASSERT_EQ(split.exit_code, 0) << split.err;
  std::vector<std::unique_ptr<Checkpoint>> results;
  std::vector<const Checkpoint*> pointers;
  for (const std::string name : {"00", "01", "02", "03"}) {
    const Outcome trained = RunSemfoam({"foam_trainer", "--block_path", (blocks / name).string()});
    ASSERT_EQ(trained.exit_code, 0) << trained.err;
    results.push_back(std::make_unique<Checkpoint>(blocks / name / "block.ckpt"));
    pointers.push_back(results.back().get());
  }
  const fs::path joined_path = *folder_ / "joined.ckpt";
  {
    const Checkpoint of_split(blocks / "split.ckpt");
    WriteCheckpoint(joined_path, JoinBlocks(of_split, pointers).contents);
  }
  Model joined = ReadModel(blocks / "run.foam");
  joined.foam = FoamOf(Checkpoint(joined_path));
  const fs::path foam_path = *folder_ / "joined.foam";
  WriteModel(foam_path, joined);

  const fs::path whole = *folder_ / "joined meshes", output = *folder_ / "trained meshes";
  const Outcome expected = RunSemfoam(Exporter("mesh_exporter",
                                               {"--foam_path", foam_path.string()},
                                               whole,
                                               {"--MeshExport.method", "cells"}));
  ASSERT_EQ(expected.exit_code, 0) << expected.err;
  const Outcome outcome = RunSemfoam(Exporter("mesh_exporter", ByBlock(blocks), output));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  ExpectSameObjects(output, whole);
  EXPECT_THAT(outcome.err, Not(HasSubstr("WARNING")));
  for (const fs::path file : FilesBelow(whole)) {
    if (file.extension() != ".ply") continue;
    EXPECT_EQ(fs::file_size(output / file), fs::file_size(whole / file)) << file;
  }
}

}  // namespace
}  // namespace semfoam
