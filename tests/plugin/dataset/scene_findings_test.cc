// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/scene_findings.h"

#include "foam/train/checkpoint.h"
#include "plugin/dataset/scene_memory.h"
#include "plugin/dataset/training_scene.h"

#include "tests/plugin/dataset/small_workspace.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// b.png is the one photo that is drawn; a.png, the first by name, is held out.
class SceneFindingsTest : public testing::Test {
 protected:
  SceneFindingsTest() {
    // Points that the photos see, so that there are tracks to be surveyed.
    for (uint64_t id = 10; id < 30; ++id) {
      Point3D point;
      point.id = id;
      point.position = {0.02 * static_cast<double>(id) - 0.4, 0.1, 0.02 * static_cast<double>(id)};
      for (Image& image : workspace_.model.images) {
        point.track.push_back({image.id, static_cast<uint32_t>(image.points.size())});
        image.points.push_back({1.0 + 0.2 * static_cast<double>(id), 3.5, id});
      }
      workspace_.model.points.push_back(point);
    }
    workspace_.WriteModelFiles();
    options_ = workspace_.Options();
    options_.test_every = 3;
  }

  SceneFindings Find() {
    ScenePlan plan = PlanScene(options_);
    const FileChecksums checksums = ChecksumsOfFiles(plan);
    LoadOptions load;
    load.keeps_findings = true;
    SceneFindings findings = TrainingScene(std::move(plan), load).TakeFindings();
    findings.checksums = checksums;
    return findings;
  }
  ScenePlan PlanOfBlock() const {
    ScenePlan plan = PlanScene(options_);
    plan.is_drawn = {0, 1, 0};
    return plan;
  }

  SmallWorkspace workspace_;
  SceneOptions options_;
};

TEST_F(SceneFindingsTest, ComeBackFromTheirFile) {
  const SceneFindings findings = Find();
  const std::filesystem::path path = workspace_.temp / "photos.ckpt";
  WriteSceneFindings(path, findings);
  const std::optional<SceneFindings> read = ReadSceneFindings(path, PlanScene(options_));
  ASSERT_TRUE(read);
  ASSERT_EQ(read->photos.size(), 3u);
  size_t num_patches = 0, num_samples = 0;
  for (size_t i = 0; i < 3; ++i) {
    const PhotoFindings &a = findings.photos[i], &b = read->photos[i];
    EXPECT_EQ(a.survey.patches, b.survey.patches);
    EXPECT_EQ(a.survey.contrasts, b.survey.contrasts);
    EXPECT_EQ(a.survey.border_pixels, b.survey.border_pixels);
    EXPECT_EQ(a.survey.white_border_pixels, b.survey.white_border_pixels);
    EXPECT_EQ(a.contrast.Values(), b.contrast.Values());
    EXPECT_EQ(a.contrast.At(7, 5), b.contrast.At(7, 5));
    EXPECT_EQ(a.mask.is_rgb, b.mask.is_rgb);
    EXPECT_EQ(a.mask.ids, b.mask.ids);
    EXPECT_EQ(a.mask.num_zero, b.mask.num_zero);
    EXPECT_EQ(a.mask.size, b.mask.size);
    EXPECT_EQ(a.samples.pixels_of, b.samples.pixels_of);
    EXPECT_EQ(a.samples.index_at, b.samples.index_at);
    num_patches += b.survey.patches.size();
    num_samples += b.samples.index_at.size();
  }
  EXPECT_GT(num_patches, 0u);
  EXPECT_GT(num_samples, 0u);
  EXPECT_EQ(read->checksums.photos, findings.checksums.photos);
  EXPECT_EQ(read->checksums.masks, findings.checksums.masks);
}

TEST_F(SceneFindingsTest, AreOfOtherPhotosWhereTheirNumberOrSizeDiffers) {
  const std::filesystem::path path = workspace_.temp / "photos.ckpt";
  WriteSceneFindings(path, Find());
  ScenePlan plan = PlanScene(options_);
  plan.photos[2].width = 80;
  EXPECT_FALSE(ReadSceneFindings(path, plan));
  plan.photos.pop_back();
  EXPECT_FALSE(ReadSceneFindings(path, plan));
  const std::string bytes = ReadFile(path);
  WriteFile(path, bytes.substr(0, bytes.size() / 2));
  EXPECT_THROW(ReadSceneFindings(path, PlanScene(options_)), DamagedCheckpoint);
}

// The two photos that are not drawn are damaged behind their headers.
TEST_F(SceneFindingsTest, TakeThePlaceOfPhotosThatAreNotDrawn) {
  const TrainingScene all(PlanScene(options_));
  const SceneFindings known = Find();
  for (const char* name : {"a.png", "sub/c.png"}) {
    const std::string bytes = ReadFile(workspace_.temp / "images" / name);
    WriteFile(workspace_.temp / "images" / name, bytes.substr(0, bytes.size() - 30));
  }
  EXPECT_THROW(TrainingScene{PlanOfBlock()}, UserError);

  LoadOptions load;
  load.known = &known;
  int num_reported = 0;
  load.report = [&](int, int total) {
    ++num_reported;
    EXPECT_EQ(total, 1);
  };
  const TrainingScene scene(PlanOfBlock(), load);
  EXPECT_EQ(num_reported, 1);
  ASSERT_EQ(scene.Labels().size(), all.Labels().size());
  for (int view = 0; view < 3; ++view) {
    EXPECT_EQ(scene.Contrast(view)->Values(), all.Contrast(view)->Values());
    EXPECT_EQ(scene.Survey(view).patches, all.Survey(view).patches);
    EXPECT_EQ(scene.HoldsPhoto(view), view == 1);
  }
  TrainingRay ray, expected;
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 8; ++x) {
      ASSERT_EQ(scene.Ray(1, x, y, &ray), all.Ray(1, x, y, &expected));
      EXPECT_EQ(ray.color, expected.color);
      EXPECT_EQ(ray.class_index, expected.class_index);
    }
  }
  // The others are read at a request.
  EXPECT_THROW(scene.OpenView(2), UserError);
  workspace_.WritePhoto("sub/c.png", 8, 6);
  const auto opened = scene.OpenView(2), held = all.OpenView(2);
  EXPECT_EQ(opened->At(5, 4).color[0], held->At(5, 4).color[0]);
  EXPECT_EQ(opened->At(5, 4).Class(), held->At(5, 4).Class());
}

TEST_F(SceneFindingsTest, ChecksumsOfPhotosThatAreNotDrawnAreTheKnownOnes) {
  const SceneFindings known = Find();
  const SceneChecksums before = AllChecksumsOf(PlanScene(options_));
  WriteFile(workspace_.temp / "images/a.png", ReadFile(workspace_.temp / "images/b.png"));
  const ScenePlan plan = PlanOfBlock();
  EXPECT_EQ(ChecksumsOf(plan, ChecksumsOfFiles(plan, &known.checksums)).photos, before.photos);
  EXPECT_NE(AllChecksumsOf(plan).photos, before.photos);
  // Of a photo that is drawn, the file itself counts.
  WriteFile(workspace_.temp / "images/b.png", ReadFile(workspace_.temp / "images/sub/c.png"));
  EXPECT_NE(ChecksumsOf(plan, ChecksumsOfFiles(plan, &known.checksums)).photos, before.photos);
}

TEST_F(SceneFindingsTest, MemoryIsThatOfThePhotosThatAreDrawn) {
  const SceneMemory all = MemoryOf(PlanScene(options_)), block = MemoryOf(PlanOfBlock());
  EXPECT_EQ(block.always, all.always);
  EXPECT_EQ(3 * (block.held - block.always), all.held - all.always);
}

}  // namespace
}  // namespace semfoam
