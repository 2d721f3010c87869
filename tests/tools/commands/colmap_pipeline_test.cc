// SPDX-License-Identifier: GPL-3.0-or-later
//
// From photos to objects: COLMAP itself makes the model, as a user would have it made, and the
// program takes the workspace as COLMAP left it.
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/colmap_model.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <optional>
#include <sstream>

#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::Contains;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

void Colmap(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"QT_QPA_PLATFORM=offscreen", "colmap"});
  const Outcome run = RunProgram("env", arguments);
  ASSERT_EQ(run.exit_code, 0) << arguments[2] << "\n" << run.out << run.err;
}

// The numbers of a line of the program's table that begins with `name`.
std::vector<double> RowOf(const std::string& table, const std::string& name) {
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string first;
    if (!(words >> first) || first != name) continue;
    std::vector<double> numbers;
    for (double number; words >> number;) numbers.push_back(number);
    return numbers;
  }
  ADD_FAILURE() << "no row " << name << " in\n" << table;
  return {0};
}

// A quarter of the way around the table, and one photo from the other side, which no other sees
// enough of. The model is made once for all tests.
class ColmapPipelineTest : public testing::Test {
 protected:
  static constexpr int kFirst = 8;  // held out are 0008 and 0016, whose exact masks are known
  static constexpr int kNumPhotos = 16;

  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    std::vector<std::string> stems = {"0045"};
    for (int i = kFirst; i < kFirst + kNumPhotos; ++i) {
      stems.push_back((i < 10 ? "000" : "00") + std::to_string(i));
    }
    for (const char* part : {"images", "object_mask", "sparse"}) {
      fs::create_directories(Workspace() / part);
    }
    for (const std::string& stem : stems) {
      fs::copy(kTabletop / "images" / (stem + ".jpg"), Workspace() / "images");
      fs::copy(kTabletop / "object_mask" / (stem + ".png"), Workspace() / "object_mask");
    }
    fs::copy(kTabletop / "labels.json", Workspace());
    fs::copy(kTabletop / "segmentation_labels",
             Workspace() / "segmentation_labels",
             fs::copy_options::recursive);

    // Of the same photos COLMAP makes one model or another: in one run of some dozens its mapper
    // begins with a pair from which it gets no farther.
    for (int attempt = 0; attempt < 3 && NumRegistered() < 13; ++attempt) MakeModel();
  }

  static void MakeModel() {
    fs::remove(Workspace() / "database.db");
    fs::remove_all(Workspace() / "sparse");
    fs::create_directories(Workspace() / "sparse");
    const std::string database = (Workspace() / "database.db").string();
    const std::string images = (Workspace() / "images").string();
    Colmap({"feature_extractor",
            "--database_path",
            database,
            "--image_path",
            images,
            "--ImageReader.single_camera",
            "1",
            "--ImageReader.camera_params",
            "266.7,160,120,0",
            "--SiftExtraction.use_gpu",
            "0",
            "--SiftExtraction.num_threads",
            "1",
            "--SiftExtraction.max_num_features",
            "1500"});
    Colmap({"sequential_matcher",
            "--database_path",
            database,
            "--SiftMatching.use_gpu",
            "0",
            "--SiftMatching.num_threads",
            "1",
            "--SequentialMatching.overlap",
            "5",
            "--SequentialMatching.quadratic_overlap",
            "0"});
    // Small photos have few matches.
    Colmap({"mapper",
            "--database_path",
            database,
            "--image_path",
            images,
            "--output_path",
            (Workspace() / "sparse").string(),
            "--Mapper.num_threads",
            "1",
            "--Mapper.multiple_models",
            "0",
            "--Mapper.min_num_matches",
            "8",
            "--Mapper.init_min_num_inliers",
            "30",
            "--Mapper.init_min_tri_angle",
            "6",
            "--Mapper.abs_pose_min_num_inliers",
            "12",
            "--Mapper.abs_pose_min_inlier_ratio",
            "0.1"});
  }
  static void TearDownTestSuite() { delete folder_; }
  void SetUp() override { ASSERT_GE(NumRegistered(), 13u); }

  // Photos of the model, whose file of images begins with their number; 0 without a model.
  static uint64_t NumRegistered() {
    uint64_t count = 0;
    std::ifstream file(Workspace() / "sparse/0/images.bin", std::ios::binary);
    file.read(reinterpret_cast<char*>(&count), sizeof(count));
    return file ? count : 0;
  }

  static fs::path Workspace() { return *folder_ / "workspace"; }
  static fs::path Out(const std::string& name) { return *folder_ / name; }

  static TempFolder* folder_;
};
TempFolder* ColmapPipelineTest::folder_ = nullptr;

TEST_F(ColmapPipelineTest, PhotosBecomeObjects) {
  const Outcome run = RunSemfoam({"automatic_segmenter",
                                  "--workspace_path",
                                  Workspace().string(),
                                  "--output_path",
                                  Out("all").string(),
                                  "--test_every",
                                  "8",
                                  "--quality",
                                  "low",
                                  "--FoamTraining.num_rays",
                                  "1000000",
                                  "--FoamTraining.final_sites",
                                  "15000",
                                  "--VolumeExport.max_resolution",
                                  "64"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.Errors(), IsEmpty());
  // COLMAP may find a photo less where its floating point differs.
  EXPECT_THAT(run.err, ContainsRegex("1[3-6] photos, 2 held out, [1-4] more not registered; "));
  EXPECT_THAT(run.err, ContainsRegex("1[3-6] of 1[3-6] photos have a mask, "));

  const Outcome scores = RunSemfoam({"foam_evaluator",
                                     "--foam_path",
                                     (Out("all") / "scene.foam").string(),
                                     "--image_path",
                                     (Workspace() / "images").string()});
  ASSERT_EQ(scores.exit_code, 0) << scores.err;
  SCOPED_TRACE(scores.out);
  // One colour for each photo makes some 13 dB.
  EXPECT_GT(RowOf(scores.out, "0008.jpg")[0], 16);
  EXPECT_GT(RowOf(scores.out, "0016.jpg")[0], 18);
  EXPECT_GT(RowOf(scores.out, "mug")[0], 0.6);
  EXPECT_GT(RowOf(scores.out, "table")[0], 0.6);

  const json labels = json::parse(ReadFile(Out("all") / "labels.json"));
  std::vector<std::string> names;
  for (const json& object : labels["objects"]) {
    names.push_back(object["name"]);
    for (const json& file : object["files"]) {
      EXPECT_GT(fs::file_size(Out("all") / file.get<std::string>()), 0u);
    }
  }
  for (const char* name : {"mug", "table", "plant", "floor"}) EXPECT_THAT(names, Contains(name));
}

// Binary or text, and in whatever order COLMAP writes it: the model is the same, and so is the
// foam, to the byte.
TEST_F(ColmapPipelineTest, TextTrainsTheSameFoam) {
  const fs::path text = *folder_ / "text";
  fs::create_directories(text);
  Colmap({"model_converter",
          "--input_path",
          (Workspace() / "sparse/0").string(),
          "--output_path",
          text.string(),
          "--output_type",
          "TXT"});
  ASSERT_TRUE(fs::exists(text / "images.txt"));
  for (const auto& [name, model] :
       {std::pair("bin", Workspace() / "sparse/0"), std::pair("txt", text)}) {
    const Outcome run = RunSemfoam(TinyTraining({"foam_trainer",
                                                 "--image_path",
                                                 (Workspace() / "images").string(),
                                                 "--input_path",
                                                 model.string(),
                                                 "--output_path",
                                                 Out(name).string()}));
    ASSERT_EQ(run.exit_code, 0) << run.err;
  }
  EXPECT_TRUE(ReadFile(Out("bin") / "scene.foam") == ReadFile(Out("txt") / "scene.foam"));
}

// A photo that is taken out of the model and registered again is where it was.
TEST_F(ColmapPipelineTest, RegisteredPhotosAreRead) {
  const fs::path less = *folder_ / "less", again = *folder_ / "again";
  fs::create_directories(less);
  fs::create_directories(again);
  WriteFile(*folder_ / "names.txt", "0012.jpg\n");
  Colmap({"image_deleter",
          "--input_path",
          (Workspace() / "sparse/0").string(),
          "--output_path",
          less.string(),
          "--image_names_path",
          (*folder_ / "names.txt").string()});
  Colmap({"image_registrator",
          "--database_path",
          (Workspace() / "database.db").string(),
          "--input_path",
          less.string(),
          "--output_path",
          again.string(),
          "--Mapper.abs_pose_min_num_inliers",
          "12",
          "--Mapper.abs_pose_min_inlier_ratio",
          "0.1"});
  const auto center_in = [](const fs::path& folder, const std::string& name) {
    for (const Image& image : ReadReconstruction(folder).images) {
      if (image.name == name) return std::optional(image.cam_from_world.Center());
    }
    return std::optional<Eigen::Vector3d>();
  };
  const auto before = center_in(Workspace() / "sparse/0", "0012.jpg");
  const auto next = center_in(Workspace() / "sparse/0", "0013.jpg");
  const auto after = center_in(again, "0012.jpg");
  ASSERT_TRUE(before && next && after);
  EXPECT_FALSE(center_in(less, "0012.jpg"));
  EXPECT_LT((*after - *before).norm(), 0.1 * (*next - *before).norm());
}

// Masks that were made before image_undistorter changed the photos lie beside what they show, which
// nobody sees where the sizes are nearly the same: every command that reads masks tells.
TEST_F(ColmapPipelineTest, MasksMadeBeforeUndistortionAreToldOf) {
  const fs::path distorted = *folder_ / "distorted", workspace = *folder_ / "undistorted";
  Reconstruction model = ReadReconstruction(Workspace() / "sparse/0");
  model.cameras[0].model_id = FindCameraModel("SIMPLE_RADIAL")->id;
  model.cameras[0].params = {266.7, 160, 120, -0.002};
  WriteReconstruction(distorted, model, ModelFormat::kBinary);
  Colmap({"image_undistorter",
          "--image_path",
          (Workspace() / "images").string(),
          "--input_path",
          distorted.string(),
          "--output_path",
          workspace.string()});
  fs::copy(Workspace() / "object_mask", workspace / "object_mask");
  const std::string warning =
      "WARNING: 1[3-6] of 1[3-6] masks seem to be of photos that were not yet undistorted, the "
      "first of them .*object_mask/0008.png, 320 x 240 pixels for a photo of 319 x 239; masks made "
      "of the undistorted photos, or by mask_undistorter, would be right.\n";
  for (const std::vector<std::string>& command : {
           TinyTraining({"automatic_segmenter", "--formats", "om", "--workspace_path"}),
           {"mask_analyzer", "--workspace_path"},
           {"point_labeler", "--workspace_path"},
       }) {
    SCOPED_TRACE(command[0]);
    const auto run_on = [&](const fs::path& folder, const std::string& output) {
      std::vector<std::string> arguments = command;
      const auto place = std::find(arguments.begin(), arguments.end(), "--workspace_path");
      arguments.insert(place + 1, folder.string());
      arguments.insert(arguments.end(), {"--output_path", Out(output).string()});
      return RunSemfoam(arguments);
    };
    const Outcome run = run_on(workspace, command[0]);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.err, ContainsRegex(warning));
    const Outcome as_made = run_on(Workspace(), command[0] + "_as_made");
    ASSERT_EQ(as_made.exit_code, 0) << as_made.err;
    EXPECT_THAT(as_made.err, Not(HasSubstr("undistorted")));
  }
  // The command that it names makes masks without fault.
  fs::rename(workspace / "object_mask", workspace / "masks before");
  const Outcome made = RunSemfoam({"mask_undistorter",
                                   "--mask_path",
                                   (workspace / "masks before").string(),
                                   "--input_path",
                                   distorted.string(),
                                   "--undistorted_path",
                                   workspace.string(),
                                   "--output_path",
                                   (workspace / "object_mask").string()});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Outcome after = RunSemfoam({"mask_analyzer",
                                    "--workspace_path",
                                    workspace.string(),
                                    "--output_path",
                                    Out("undistorted_masks").string()});
  ASSERT_EQ(after.exit_code, 0) << after.err;
  EXPECT_THAT(after.err, Not(HasSubstr("not yet undistorted")));
}

}  // namespace
}  // namespace semfoam
