// SPDX-License-Identifier: GPL-3.0-or-later
//
// foam_labeler as a user meets it: a foam that was trained without masks gets its labels from masks
// of two photos, from clicks, and from nothing that it should not take them from.
#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/model/cell_labels.h"
#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/tools/few_photos.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

// Of the photos 0000, 0004, ... 0060 those of every eighth are held out: 0000 and 0032.
class FoamLabelerTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempFolder;
    MakeTabletopOfFewPhotos(Workspace());
    for (const char* photo : {"0008", "0044"}) CopyMask(photo, FewMasks());
    fs::copy(Workspace() / "labels.json", FewMasks());
    const Outcome outcome = RunSemfoam(Training("plain", {"--Effects.semantics", "off"}));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }
  static void TearDownTestSuite() { delete folder_; }

  static fs::path Workspace() { return *folder_ / "a workspace"; }
  static fs::path FewMasks() { return *folder_ / "few masks"; }
  static fs::path Plain() { return *folder_ / "plain/scene.foam"; }

  static void CopyMask(const std::string& photo, const fs::path& target) {
    fs::create_directories(target);
    fs::copy(Workspace() / "object_mask" / (photo + ".png"), target);
  }

  static std::vector<std::string> Training(const std::string& name,
                                           const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"foam_trainer",
                                          "--image_path",
                                          (Workspace() / "images").string(),
                                          "--input_path",
                                          (Workspace() / "sparse/0").string(),
                                          "--output_path",
                                          (*folder_ / name).string(),
                                          "--test_every",
                                          "8"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return TinyTraining(arguments);
  }

  static std::vector<std::string> Command(const std::string& name) {
    return {"foam_labeler",
            "--foam_path",
            Plain().string(),
            "--output_path",
            (*folder_ / name).string()};
  }

  static Outcome Label(const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> arguments = Command(name);
    arguments.insert(arguments.end(), more.begin(), more.end());
    return RunSemfoam(arguments);
  }

  static std::vector<std::string> NamesIn(const Model& model) {
    std::vector<std::string> names;
    for (const semfoam::Label& label : model.labels) names.push_back(label.name);
    return names;
  }

  static std::vector<ClassIndex> ClassesIn(const Model& model) {
    return LabelCells(model.foam, Triangulate(WithGuardSites(model.foam.positions))).class_index;
  }

  static double ShareOfSame(const std::vector<ClassIndex>& a, const std::vector<ClassIndex>& b) {
    EXPECT_EQ(a.size(), b.size());
    int64_t same = 0;
    for (size_t i = 0; i < std::min(a.size(), b.size()); ++i) same += a[i] == b[i] ? 1 : 0;
    return static_cast<double>(same) / static_cast<double>(b.size());
  }

  static TempFolder* folder_;
};

TempFolder* FoamLabelerTest::folder_ = nullptr;

TEST_F(FoamLabelerTest, ChangesNothingButLabels) {
  const Outcome outcome =
      Label("few", {"--workspace_path", Workspace().string(), "--mask_path", FewMasks().string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("mug"));
  EXPECT_THAT(FilesBelow(*folder_ / "few"), ElementsAre("scene.foam"));
  const Model before = ReadModel(Plain()), after = ReadModel(*folder_ / "few/scene.foam");
  EXPECT_FALSE(before.foam.HasSemantics());
  EXPECT_TRUE(after.foam.HasSemantics());
  EXPECT_EQ(after.foam.positions, before.foam.positions);
  EXPECT_EQ(after.foam.raw_density, before.foam.raw_density);
  EXPECT_EQ(after.foam.assumed_density, before.foam.assumed_density);
  EXPECT_EQ(after.foam.sh, before.foam.sh);
  EXPECT_EQ(after.statistics.contribution, before.statistics.contribution);
}

// The same masks again give the labels that they gave in the training.
TEST_F(FoamLabelerTest, LabelsAsATrainingOnFewMasksDoes) {
  const Outcome trained = RunSemfoam(Training("trained", {"--mask_path", FewMasks().string()}));
  ASSERT_EQ(trained.exit_code, 0) << trained.err;
  const fs::path foam = *folder_ / "trained/scene.foam";
  const Outcome outcome = RunSemfoam({"foam_labeler",
                                      "--foam_path",
                                      foam.string(),
                                      "--output_path",
                                      (*folder_ / "as trained").string(),
                                      "--workspace_path",
                                      Workspace().string(),
                                      "--mask_path",
                                      FewMasks().string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Model expected = ReadModel(foam), after = ReadModel(*folder_ / "as trained/scene.foam");
  EXPECT_EQ(NamesIn(after), NamesIn(expected));
  EXPECT_EQ(after.foam.classifier_weight, expected.foam.classifier_weight);
  // But for what colours of hidden cells, which are their neighbours' since, conduct.
  EXPECT_GT(ShareOfSame(ClassesIn(after), ClassesIn(expected)), 0.99);
}

TEST_F(FoamLabelerTest, WritesTheSameBytesOnAnyThreads) {
  std::string bytes;
  for (const char* threads : {"1", "2", "5"}) {
    const std::string name = std::string("threads ") + threads;
    const Outcome outcome = Label(name,
                                  {"--workspace_path",
                                   Workspace().string(),
                                   "--mask_path",
                                   FewMasks().string(),
                                   "--num_threads",
                                   threads});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::string written = ReadFile(*folder_ / name / "scene.foam");
    if (bytes.empty()) bytes = written;
    EXPECT_TRUE(written == bytes) << threads;
  }
}

// A model of the same photos in another frame, which is turned by nothing, moved and scaled.
TEST_F(FoamLabelerTest, NeedsTheSamePhotosNotTheSameFrame) {
  Reconstruction moved = ReadReconstruction(Workspace() / "sparse/0");
  const Eigen::Vector3d shift(100, -20, 3);
  const double scale = 7;
  for (Image& image : moved.images) {
    const Eigen::Vector3d center = scale * image.cam_from_world.Center() + shift;
    image.cam_from_world.translation = -(image.cam_from_world.UnitRotation() * center);
  }
  for (Point3D& point : moved.points) point.position = scale * point.position + shift;
  WriteReconstruction(*folder_ / "moved", moved, ModelFormat::kBinary);
  const std::vector<std::string> photos = {"--image_path",
                                           (Workspace() / "images").string(),
                                           "--labels_path",
                                           (Workspace() / "labels.json").string(),
                                           "--mask_path",
                                           FewMasks().string(),
                                           "--input_path"};
  const auto labelled = [&](const std::string& name, const fs::path& model) {
    std::vector<std::string> arguments = photos;
    arguments.push_back(model.string());
    const Outcome outcome = Label(name, arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return ClassesIn(ReadModel(*folder_ / name / "scene.foam"));
  };
  const auto there = labelled("there", *folder_ / "moved"),
             here = labelled("here", Workspace() / "sparse/0");
  EXPECT_GT(ShareOfSame(there, here), 0.999);
}

// One file of marks on two photos, as the page of report_writer saves it.
TEST_F(FoamLabelerTest, TakesClicks) {
  const auto mark = [](const char* name, const char* type, const json& points) {
    return json{{"label", name}, {"shape_type", type}, {"points", points}, {"group_id", nullptr}};
  };
  const auto photo = [](const char* name, const json& shapes) {
    return json{{"shapes", shapes},
                {"imagePath", name},
                {"imageData", nullptr},
                {"imageHeight", 240},
                {"imageWidth", 320}};
  };
  WriteFile(*folder_ / "marks.json",
            json::array({photo("0008.jpg",
                               {mark("upper part", "point", {{160, 30}}),
                                mark("lower part", "point", {{160, 220}})}),
                         photo("0044.jpg",
                               {mark("upper part", "point", {{160, 30}}),
                                mark("lower part", "polygon", {{120, 180}, {200, 180}, {160, 230}}),
                                mark("lower part", "point", {{160, 200}})})})
                .dump());
  const Outcome outcome = Label("clicks",
                                {"--workspace_path",
                                 Workspace().string(),
                                 "--mask_path",
                                 (*folder_ / "marks.json").string()});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, HasSubstr("Masks of 2 photos are grown from strokes"));
  EXPECT_THAT(FilesBelow(*folder_ / "clicks"), ElementsAre("scene.foam"));
  // What no mark is on has the label of its surroundings; there is no third class.
  EXPECT_THAT(NamesIn(ReadModel(*folder_ / "clicks/scene.foam")),
              UnorderedElementsAre("upper part", "lower part"));
}

TEST_F(FoamLabelerTest, LabelsBecomeObjects) {
  ASSERT_EQ(Label("objects", {"--workspace_path", Workspace().string()}).exit_code, 0);
  const Outcome exported = RunSemfoam({"mesh_exporter",
                                       "--foam_path",
                                       (*folder_ / "objects/scene.foam").string(),
                                       "--output_path",
                                       (*folder_ / "meshes").string(),
                                       "--labels",
                                       "table",
                                       "--formats",
                                       "ply"});
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  EXPECT_THAT(FilesBelow(*folder_ / "meshes"), testing::Contains(HasSubstr("_table.ply")));
  // Labels again, in place of those that it has.
  const fs::path again = *folder_ / "again";
  const Outcome relabelled = RunSemfoam({"foam_labeler",
                                         "--foam_path",
                                         (*folder_ / "objects/scene.foam").string(),
                                         "--output_path",
                                         again.string(),
                                         "--workspace_path",
                                         Workspace().string(),
                                         "--mask_path",
                                         FewMasks().string()});
  ASSERT_EQ(relabelled.exit_code, 0) << relabelled.err;
  ASSERT_EQ(Label("once", {"--workspace_path", Workspace().string(), "--mask_path", FewMasks()})
                .exit_code,
            0);
  EXPECT_EQ(ReadModel(again / "scene.foam").foam.identity,
            ReadModel(*folder_ / "once/scene.foam").foam.identity);
}

TEST_F(FoamLabelerTest, SaysWhatIsWrong) {
  const std::string workspace = Workspace().string();
  CopyMask("0032", *folder_ / "held out");
  fs::create_directories(*folder_ / "no masks");
  // Another photo than those that it was trained on.
  const fs::path more = *folder_ / "more";
  fs::create_directories(more);
  WriteReconstruction(
      more / "sparse/0", ReadReconstruction(kTabletop / "sparse/0"), ModelFormat::kBinary);
  ExpectEachRefused(
      Command("failed"),
      {{{}, {"", {"workspace_path", "image_path", "input_path"}, "are given"}},
       {{"--workspace_path", (*folder_ / "none").string()},
        {"none", {}, "there is no such folder"}},
       {{"--workspace_path", workspace, "--mask_path", (*folder_ / "held out").string()},
        {"scene.foam", {"mask_path"}, "cannot be labelled"}},
       {{"--workspace_path", workspace, "--mask_path", (*folder_ / "no masks").string()},
        {"no masks", {}, "is empty"}},
       {{"--image_path",
         (kTabletop / "images").string(),
         "--input_path",
         more.string(),
         "--mask_path",
         FewMasks().string()},
        {"scene.foam", {"0001.jpg"}, "was not trained on"}}},
      *folder_ / "failed");
}

}  // namespace
}  // namespace semfoam
