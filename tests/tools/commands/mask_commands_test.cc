// SPDX-License-Identifier: GPL-3.0-or-later
//
// mask_importer, mask_renderer and mask_undistorter as a user meets them.
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/mask/label_png.h"
#include "plugin/mask/mask_png.h"
#include "tools/images/view_images.h"

#include <algorithm>
#include <cmath>
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

// The tabletop's model, as if its photos had been taken with another camera.
void WriteTabletopWith(const Camera& camera, const fs::path& folder) {
  Reconstruction model = ReadReconstruction(kTabletop / "sparse/0");
  const uint32_t id = model.cameras.at(0).id;
  model.cameras = {camera};
  model.cameras[0].id = id;
  WriteReconstruction(folder, model, ModelFormat::kBinary);
}

// Distorted photos, and the workspace that image_undistorter would have made of them.
struct UndistortedTabletop {
  UndistortedTabletop() {
    WriteTabletopWith(lens, temp / "distorted/sparse/0");
    WriteTabletopWith(pinhole, temp / "dense/sparse");
  }

  // The command with all paths but those of the masks.
  std::vector<std::string> Command(const fs::path& output,
                                   const std::vector<std::string>& more) const {
    std::vector<std::string> arguments = {"mask_undistorter",
                                          "--input_path",
                                          (temp / "distorted").string(),
                                          "--undistorted_path",
                                          (temp / "dense").string(),
                                          "--output_path",
                                          output.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  // The index of the original photo's pixel that an undistorted one shows; -1 = none.
  int64_t Source(int x, int y) const {
    const auto place = Project(lens, Eigen::Vector3d((x - 170) / 266.7, (y - 123) / 266.7, 1));
    const auto column = static_cast<int64_t>(std::floor(place->x()));
    const auto row = static_cast<int64_t>(std::floor(place->y()));
    const bool is_inside = column >= 0 && row >= 0 && column < 320 && row < 240;
    return is_inside ? row * 320 + column : -1;
  }

  const TempFolder temp;
  const Camera lens = {1, FindCameraModel("SIMPLE_RADIAL")->id, 320, 240, {266.7, 160, 120, -0.15}};
  const Camera pinhole = {
      1, FindCameraModel("PINHOLE")->id, 341, 247, {266.7, 266.7, 170.5, 123.5}};
};

TEST(MaskUndistorter, GivesAnUndistortedWorkspaceItsMasks) {
  const UndistortedTabletop scene;
  const fs::path dense = scene.temp / "dense";
  const Outcome outcome = RunSemfoam(
      scene.Command(dense / "object_mask", {"--mask_path", (kTabletop / "object_mask").string()}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, testing::HasSubstr("Masks of 64 of 64 photos are in "));
  EXPECT_EQ(Json::parse(ReadFile(dense / "object_mask/labels.json"))["labels"],
            Json::parse(ReadFile(kTabletop / "labels.json"))["labels"]);
  const std::vector<int32_t> before = IdsIn(kTabletop / "object_mask/0008.png");
  const std::vector<int32_t> after = IdsIn(dense / "object_mask/0008.png");
  ASSERT_EQ(after.size(), size_t{341 * 247});
  for (int y = 0; y < 247; ++y) {
    for (int x = 0; x < 341; ++x) {
      const int64_t source = scene.Source(x, y);
      ASSERT_EQ(after[static_cast<size_t>(y) * 341 + x], source < 0 ? 0 : before[source])
          << x << ", " << y;
    }
  }
  EXPECT_GT(std::count_if(after.begin(), after.end(), [](int32_t id) { return id > 0; }),
            341 * 247 / 2);
  // Commands take them for the photos' masks.
  const Outcome points = RunSemfoam({"point_labeler",
                                     "--workspace_path",
                                     dense.string(),
                                     "--output_path",
                                     (scene.temp / "points").string()});
  EXPECT_EQ(points.exit_code, 0) << points.err;
  EXPECT_THAT(points.err, testing::HasSubstr("64 of 64 photos have a mask, 0 masks unused"));
  EXPECT_THAT(points.err, testing::Not(testing::HasSubstr("undistorted")));
}

TEST(MaskUndistorter, TakesBinaryMasksOfIgnoredPixels) {
  const UndistortedTabletop scene;
  const fs::path masks = kTabletop / "segmentation_labels/masks/mug";
  const Outcome outcome =
      RunSemfoam(scene.Command(scene.temp / "ignore", {"--ignore_path", masks.string()}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, testing::HasSubstr("Masks of 8 of 64 photos are in "));
  const std::vector<int32_t> before = IdsIn(masks / "0008.png");
  const std::vector<int32_t> after = IdsIn(scene.temp / "ignore/0008.jpg.png");
  ASSERT_EQ(after.size(), size_t{341 * 247});
  for (int y = 0; y < 247; ++y) {
    for (int x = 0; x < 341; ++x) {
      const int64_t source = scene.Source(x, y);
      ASSERT_EQ(after[static_cast<size_t>(y) * 341 + x] != 0, source >= 0 && before[source] != 0)
          << x << ", " << y;
    }
  }
}

TEST(MaskUndistorter, SaysWhatIsWrong) {
  const UndistortedTabletop scene;
  const fs::path out = scene.temp / "out";
  const std::string masks = (kTabletop / "object_mask").string();
  const auto fails = [&](const std::vector<std::string>& arguments, const Mistake& mistake) {
    ExpectRefused(RunSemfoam(arguments), mistake);
    EXPECT_FALSE(fs::exists(out)) << mistake.kind;
  };
  fails(scene.Command(out, {}), {"", {"mask_path"}, "neither object_mask/ nor Annotations/"});
  fails(scene.Command(out, {"--mask_path", "none"}), {"none", {}, "there is no such folder"});
  fails(scene.Command(out, {"--ignore_path", "none"}), {"none", {}, "there is no such folder"});
  fails(scene.Command(out, {"--mask_path", masks, "--ignore_path", masks}),
        {"", {"mask_path", "ignore_path"}, "has no effect"});
  fails(scene.Command(out, {"--mask_path", masks, "--invert", "1"}),
        {"", {"invert", "ignore_path"}, "has no effect"});
  // The models in each other's place, and a folder without one.
  const std::string distorted = (scene.temp / "distorted/sparse/0").string();
  const std::string undistorted = (scene.temp / "dense/sparse").string();
  const auto with_models = [&](const std::string& input, const std::string& output) {
    return std::vector<std::string>{"mask_undistorter",
                                    "--mask_path",
                                    masks,
                                    "--input_path",
                                    input,
                                    "--undistorted_path",
                                    output,
                                    "--output_path",
                                    out.string()};
  };
  fails(with_models(undistorted, distorted),
        {distorted, {"0000.jpg", "SIMPLE_RADIAL", "image_undistorter"}, "has distortion"});
  fails(with_models(distorted, masks), {masks, {}, "holds no COLMAP model"});
  // Another reconstruction of the same photos.
  Reconstruction other = ReadReconstruction(undistorted);
  for (Image& image : other.images) {
    image.cam_from_world.rotation =
        image.cam_from_world.rotation * Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX());
  }
  WriteReconstruction(scene.temp / "other", other, ModelFormat::kText);
  fails(with_models(distorted, (scene.temp / "other").string()),
        {"other", {"0000.jpg", "degrees"}, "keeps poses"});
}

}  // namespace
}  // namespace semfoam
