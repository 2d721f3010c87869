// SPDX-License-Identifier: GPL-3.0-or-later
//
// mask_importer and mask_renderer as a user meets them.
#include "plugin/colmap/camera_rays.h"
#include "plugin/mask/label_png.h"
#include "plugin/mask/mask_png.h"
#include "tools/images/view_images.h"

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "tests/tools/commands/ring_scene.h"
#include "tests/tools/program.h"
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

// The masks of a foam's photos, as the library renders them.
std::map<std::string, LabelImage> MasksOf(const Model& model) {
  std::map<std::string, LabelImage> masks;
  const ViewRenderer renderer(model.foam);
  for (const PhotoRecord& photo : model.photos) {
    const CameraRays rays = MakeCameraRays(photo, model.world_from_normalized, "IN");
    masks.emplace(photo.name, LabelIdImage(renderer.Render(rays), model.labels));
  }
  return masks;
}

std::vector<int32_t> IdsIn(const fs::path& png) {
  const MaskPng mask = ReadMaskPng(png);
  return {mask.values.begin(), mask.values.end()};
}

TEST(MaskRenderer, WritesTheSameMasksInAllFormats) {
  const TempFolder temp;
  const Model model = RingScene();
  WriteModel(temp / "in.foam", model);
  const std::map<std::string, LabelImage> masks = MasksOf(model);
  ASSERT_EQ(masks.size(), 4u);
  // Photos, for the way back.
  for (const auto& [photo, mask] : masks) WriteLabelPng(temp / "photos" / photo, mask);
  for (const std::string format : {"png", "palette", "coco"}) {
    const Outcome outcome = RunSemfoam({"mask_renderer",
                                        "--format",
                                        format,
                                        "--foam_path",
                                        (temp / "in.foam").string(),
                                        "--output_path",
                                        (temp / format).string()});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const Json names = Json::parse(ReadFile(temp / format / "labels.json"))["labels"];
    EXPECT_EQ(names, Json({{"10", "ring"}, {"11", "table"}, {"12", "ball"}}));
    // What is written is read back by the importer.
    const Outcome back = RunSemfoam({"mask_importer",
                                     "--mask_path",
                                     (temp / format).string(),
                                     "--image_path",
                                     (temp / "photos").string(),
                                     "--output_path",
                                     (temp / (format + " again")).string()});
    ASSERT_EQ(back.exit_code, 0) << back.err;
    for (const auto& [photo, mask] : masks) {
      const std::string file = fs::path(photo).stem().string() + ".png";
      EXPECT_EQ(IdsIn(temp / (format + " again") / file), mask.data) << format;
      if (format == "coco") continue;
      EXPECT_EQ(IdsIn(temp / format / file), mask.data) << format;
      EXPECT_EQ(ReadMaskHeader(temp / format / file).is_palette, format == "palette");
      EXPECT_EQ(ReadMaskHeader(temp / format / file).bits, format == "palette" ? 8 : 16);
    }
  }
  const Json coco = Json::parse(ReadFile(temp / "coco/instances.json"));
  EXPECT_EQ(coco["images"].size(), 4u);
  const Json& annotation = coco["annotations"][0];
  const LabelImage& first = masks.at(coco["images"][0]["file_name"]);
  const auto id = annotation["track_id"].get<int32_t>();
  EXPECT_EQ(annotation["area"], std::count(first.data.begin(), first.data.end(), id));
  // The box is the least one.
  int left = first.width, top = first.height, right = 0, bottom = 0;
  for (int y = 0; y < first.height; ++y) {
    for (int x = 0; x < first.width; ++x) {
      if (first.data[y * first.width + x] != id) continue;
      left = std::min(left, x);
      right = std::max(right, x + 1);
      top = std::min(top, y);
      bottom = std::max(bottom, y + 1);
    }
  }
  EXPECT_EQ(annotation["bbox"], Json({left, top, right - left, bottom - top}));
}

TEST(MaskRenderer, SaysWhatIsWrong) {
  const TempFolder temp;
  const auto fails = [&](const Model& model, const std::string& format, const Mistake& mistake) {
    WriteModel(temp / "in.foam", model);
    ExpectRefused(RunSemfoam({"mask_renderer",
                              "--format",
                              format,
                              "--foam_path",
                              (temp / "in.foam").string(),
                              "--output_path",
                              (temp / "out").string()}),
                  mistake);
  };
  Model model = RingScene();
  model.photos.clear();
  fails(model, "png", {"in.foam", {}, "has no photos"});
  model = RingScene();
  model.labels[2].id = LabelId{256};
  fails(model, "palette", {"", {"256", "format"}, "holds ids up to 255"});
  EXPECT_FALSE(fs::exists(temp / "out"));
  fs::create_directories(temp / "out");
  WriteFile(temp / "out/labels.json", "{}");
  fails(RingScene(), "coco", {"labels.json", {}, "would be lost"});
  EXPECT_THAT(FilesBelow(temp / "out"), testing::ElementsAre("labels.json"));
}

TEST(MaskImporter, PrintsWhatItFound) {
  const TempFolder temp;
  const auto import = [&](const fs::path& masks) {
    return RunSemfoam({"mask_importer",
                       "--mask_path",
                       masks.string(),
                       "--image_path",
                       (kTabletop / "images").string(),
                       "--output_path",
                       (temp / "out").string()});
  };
  ExpectRefused(import(temp / "none"), {"none", {}, "no such file or folder"});
  EXPECT_FALSE(fs::exists(temp / "out"));
  const Outcome outcome = import(kTabletop / "segmentation_labels/masks");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err,
              testing::HasSubstr(
                  "PNGs of single objects: masks of 8 of 64 photos, matched by name; 13 labels"));
  EXPECT_THAT(outcome.out, testing::HasSubstr("mug"));
  EXPECT_EQ(FilesBelow(temp / "out").size(), 9u);
}

// A training takes masks of another format, and comes to the same end as with those that the
// importer makes of them.
TEST(MaskImporter, TrainingsUseTheSameCode) {
  const TempFolder temp;
  CopyTabletop(temp / "w");
  const Outcome imported = RunSemfoam({"mask_importer",
                                       "--mask_path",
                                       (kTabletop / "segmentation_labels/masks").string(),
                                       "--image_path",
                                       (kTabletop / "images").string(),
                                       "--output_path",
                                       (temp / "masks").string()});
  ASSERT_EQ(imported.exit_code, 0) << imported.err;
  const auto train = [&](const fs::path& masks, const std::string& output) {
    std::vector<std::string> arguments = TrainerOn(temp / "w", temp / output);
    *(std::find(arguments.begin(), arguments.end(), "--mask_path") + 1) = masks.string();
    const Outcome outcome = RunSemfoam(TinyTraining(arguments));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.err;
  };
  EXPECT_THAT(train(kTabletop / "segmentation_labels/masks", "direct"),
              testing::HasSubstr("PNGs of single objects: masks of 8 of 64 photos"));
  train(temp / "masks", "by_importer");
  EXPECT_EQ(ReadFile(temp / "direct/scene.foam"), ReadFile(temp / "by_importer/scene.foam"));
}

}  // namespace
}  // namespace semfoam
