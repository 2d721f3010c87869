// SPDX-License-Identifier: GPL-3.0-or-later
//
// What a command reads it never writes over: each is sent into the folders of its own inputs, where
// it gives one sentence and leaves every byte as it was.
#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"

#include <map>

#include "tests/tools/mask_corrupter.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;

constexpr char kIsRead[] = "will not be written";
constexpr char kNotAnExport[] = "not written by an export and would be lost";
constexpr char kNotOurs[] = "not written by this program and would be lost";

// The tabletop as W, whose photos have the names of a film's frames and which, as in some data
// sets, lie in rgb/; an untrained foam of it; a film's manifest, and masks of it.
class InputProtectionTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder();
    CopyTabletop(W());
    fs::remove(W() / "labels.json");
    Reconstruction model = ReadReconstruction(W() / "sparse/0");
    fs::create_directories(W() / "rgb");
    for (size_t i = 0; i < model.images.size(); ++i) {
      char name[32];
      std::snprintf(name, sizeof(name), "%06zu.png", i);
      fs::rename(W() / "images" / model.images[i].name, W() / "rgb" / name);
      fs::rename(W() / "object_mask" / fs::path(model.images[i].name).replace_extension(".png"),
                 W() / "object_mask" / name);
      model.images[i].name = name;
    }
    WriteReconstruction(W() / "sparse/0", model, ModelFormat::kBinary);
    const Outcome made = RunSemfoam(
        {"foam_converter", "--input_path", (W() / "sparse/0").string(), "--output_path", Foam()});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    WriteFile(W() / "manifest.json",
              R"({"version": 1, "frames": [{"file": "000000.png", "photo": "000001.jpg"},
                                           {"file": "000001.png", "photo": "000002.jpg"}]})");
  }
  static void TearDownTestSuite() { delete folder_; }

  static fs::path W() { return *folder_ / "W"; }
  static std::string Foam() { return (W() / "scene.foam").string(); }

  // Everything below W, by its name.
  static std::map<std::string, std::string> Everything() {
    std::map<std::string, std::string> bytes;
    for (const std::string& name : FilesBelow(W())) bytes[name] = ReadFile(W() / name);
    return bytes;
  }

  static void ExpectRefusal(const std::vector<std::string>& arguments,
                            const fs::path& file,
                            const std::string& kind,
                            Outcome (*run)(const std::vector<std::string>&) = RunSemfoam,
                            const std::string& named = "output_path") {
    const std::map<std::string, std::string> before = Everything();
    ExpectRefused(run(arguments), {file.string(), {named}, kind});
    // gtest would print every byte.
    EXPECT_TRUE(Everything() == before) << arguments[0];
  }

  static TempFolder* folder_;
};

TempFolder* InputProtectionTest::folder_ = nullptr;

TEST_F(InputProtectionTest, MasksAreNotDamagedInPlace) {
  const std::string masks = (W() / "object_mask").string();
  const std::vector<std::string> corrupt = {
      "--mask_path", masks, "--share", "0.5", "--output_path"};
  const auto into = [&](const fs::path& output) {
    std::vector<std::string> arguments = corrupt;
    arguments.push_back(output.string());
    return arguments;
  };
  ExpectRefusal(into(masks), W() / "object_mask/000000.png", kIsRead, RunMaskCorrupter);
  ExpectRefusal(into(W() / "sparse/../object_mask"),
                W() / "sparse/../object_mask/000000.png",
                kIsRead,
                RunMaskCorrupter);
  const fs::path link = *folder_ / "link";
  fs::create_directory_symlink(masks, link);
  ExpectRefusal(into(link), link / "000000.png", kIsRead, RunMaskCorrupter);
  // Nor are masks of another set replaced.
  fs::create_directories(W() / "other");
  fs::copy(W() / "object_mask/000003.png", W() / "other/000000.png");
  ExpectRefusal(into(W() / "other"), W() / "other/000000.png", kNotOurs, RunMaskCorrupter);
  fs::remove_all(W() / "other");
  // What it wrote itself it writes again.
  EXPECT_EQ(RunMaskCorrupter(into(*folder_ / "damaged")).exit_code, 0);
  EXPECT_EQ(RunMaskCorrupter(into(*folder_ / "damaged")).exit_code, 0);
}

TEST_F(InputProtectionTest, AFoamIsNotConvertedIntoItself) {
  ExpectRefusal(
      {"foam_converter", "--input_path", Foam(), "--output_path", Foam(), "--output_type", "text"},
      Foam(),
      kIsRead);
  const fs::path points = W() / "sparse/0/points3D.bin";
  ExpectRefusal({"foam_converter",
                 "--input_path",
                 (W() / "sparse").string(),
                 "--output_path",
                 points.string(),
                 "--output_type",
                 "text"},
                points,
                kIsRead);
}

TEST_F(InputProtectionTest, TheEffectsOfATrainingAreNotReplaced) {
  WriteFile(W() / "effects.json", "{}");
  ExpectRefusal({"scene_analyzer",
                 "--image_path",
                 (W() / "rgb").string(),
                 "--input_path",
                 (W() / "sparse/0").string(),
                 "--output_path",
                 W().string()},
                W() / "effects.json",
                "belongs to the trained foam");
  fs::remove(W() / "effects.json");
}

TEST_F(InputProtectionTest, PhotosAndMasksAreNotRenderedOver) {
  const std::vector<std::string> render = {"foam_renderer",
                                           "--foam_path",
                                           Foam(),
                                           "--input_path",
                                           (W() / "sparse/0").string(),
                                           "--output_path",
                                           W().string()};
  ExpectRefusal(render, W() / "rgb/000000.png", kNotOurs);

  fs::rename(W() / "rgb", W() / "photos");
  fs::rename(W() / "object_mask", W() / "label");
  ExpectRefusal(render, W() / "label/000000.png", kNotOurs);
  fs::rename(W() / "label", W() / "object_mask");
  fs::rename(W() / "photos", W() / "rgb");

  // Depths of others do not make them ours, and are not lost either.
  fs::create_directories(W() / "depth");
  fs::rename(W() / "rgb", W() / "photos");
  for (const std::string& name : FilesBelow(W() / "photos")) {
    WriteFile(W() / "depth" / fs::path(name).replace_extension(".exr"), "depth");
  }
  ExpectRefusal(render, W() / "depth/000000.exr", kNotOurs);
  fs::rename(W() / "photos", W() / "rgb");
  fs::remove_all(W() / "depth");

  std::vector<std::string> preview = render;
  preview.insert(preview.end(), {"--preview", "1", "--image_path", (W() / "rgb").string()});
  ExpectRefusal(preview, W() / "rgb/000000.png", kIsRead);

  // Its own pictures it renders again.
  std::vector<std::string> elsewhere = render;
  elsewhere.back() = (*folder_ / "renders").string();
  EXPECT_EQ(RunSemfoam(elsewhere).exit_code, 0);
  EXPECT_EQ(RunSemfoam(elsewhere).exit_code, 0);
}

TEST_F(InputProtectionTest, PointsOfOthersAreNotReplacedByLabelledOnes) {
  const std::vector<std::string> label = {"point_labeler",
                                          "--workspace_path",
                                          W().string(),
                                          "--output_path",
                                          (*folder_ / "points").string()};
  fs::create_directories(*folder_ / "points");
  WriteFile(*folder_ / "points/points.ply", "a laser's");
  const Outcome refused = RunSemfoam(label);
  ExpectRefused(refused, {(*folder_ / "points/points.ply").string(), {"output_path"}, kNotOurs});
  EXPECT_THAT(FilesBelow(*folder_ / "points"), ElementsAre("points.ply"));
  EXPECT_EQ(ReadFile(*folder_ / "points/points.ply"), "a laser's");
  fs::remove(*folder_ / "points/points.ply");
  EXPECT_EQ(RunSemfoam(label).exit_code, 0);
  EXPECT_EQ(RunSemfoam(label).exit_code, 0);
}

TEST_F(InputProtectionTest, ScoresAndMapsTakeNoOthersPlace) {
  // The untrained foam with a photo held out.
  Model model = ReadModel(Foam());
  for (PhotoRecord& photo : model.photos) photo.held_out = photo.name == "000000.png";
  const fs::path foam = W() / "held_out.foam";
  WriteModel(foam, model);
  const std::vector<std::string> score = {
      "foam_evaluator", "--foam_path", foam.string(), "--image_path", (W() / "rgb").string()};
  const auto with = [&](const std::string& option, const fs::path& path) {
    std::vector<std::string> arguments = score;
    arguments.insert(arguments.end(), {option, path.string()});
    return arguments;
  };
  ExpectRefusal(with("--json_path", foam), foam, kIsRead, RunSemfoam, "json_path");
  fs::create_directories(W() / "maps/error");
  fs::copy(W() / "rgb/000001.png", W() / "maps/error/000000.png");
  ExpectRefusal(with("--maps_path", W() / "maps"),
                W() / "maps/error/000000.png",
                kNotOurs,
                RunSemfoam,
                "maps_path");
  fs::remove_all(W() / "maps");
  EXPECT_EQ(RunSemfoam(with("--maps_path", *folder_ / "maps")).exit_code, 0);
  EXPECT_EQ(RunSemfoam(with("--maps_path", *folder_ / "maps")).exit_code, 0);
  fs::remove(foam);
}

TEST_F(InputProtectionTest, AFilmTakesNoPhotosPlace) {
  fs::rename(W() / "rgb", W() / "frames");
  ExpectRefusal({"view_interpolator",
                 "--foam_path",
                 Foam(),
                 "--image_path",
                 (W() / "frames").string(),
                 "--output_path",
                 W().string()},
                W() / "frames/000000.png",
                kIsRead);
  fs::rename(W() / "frames", W() / "rgb");
}

TEST_F(InputProtectionTest, MasksOfAFilmTakeNoFramesPlace) {
  ExpectRefusal({"view_interpolator",
                 "--manifest_path",
                 (W() / "manifest.json").string(),
                 "--mask_path",
                 (W() / "object_mask").string(),
                 "--output_path",
                 (W() / "object_mask").string()},
                W() / "object_mask/000001.png",
                kIsRead);
}

TEST_F(InputProtectionTest, NamesOfTheWorkspaceAreNotReplacedByAnExports) {
  const std::string sparse = (W() / "sparse/0").string();
  const std::string rgb = (W() / "rgb").string();
  const std::vector<std::vector<std::string>> commands = {
      TinyTraining({"foam_trainer", "--image_path", rgb, "--input_path", sparse}),
      TinyTraining({"automatic_segmenter", "--workspace_path", W().string(), "--image_path", rgb}),
      {"volume_exporter", "--foam_path", Foam()},
      {"mesh_exporter", "--foam_path", Foam()}};
  const fs::path labels = W() / "labels.json";

  // With names of nothing in the masks; and no JSON at all.
  for (const std::string text :
       {R"({"labels": {"6": "mug", "999": "ghost"}, "by": "me"})", "6 mug"}) {
    WriteFile(labels, text);
    for (std::vector<std::string> arguments : commands) {
      // What a training makes of such a file is told before.
      if (text == "6 mug" && arguments[0] != "volume_exporter" && arguments[0] != "mesh_exporter") {
        continue;
      }
      arguments.insert(arguments.end(), {"--output_path", W().string()});
      if (text == "6 mug") {
        ExpectRefusal(arguments, labels, "no valid JSON", RunSemfoam, "byte 3 of 5");
      } else {
        ExpectRefusal(arguments, labels, kNotAnExport);
      }
    }
  }
  fs::remove(labels);
}

}  // namespace
}  // namespace semfoam
