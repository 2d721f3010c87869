// SPDX-License-Identifier: GPL-3.0-or-later
//
// A workspace with everything that COLMAP allows and tidy ones do not have: cameras of two sizes
// and one that took nothing, photos of the same name in two folders and of two kinds, one smaller
// than its camera, photos that were not registered, an image without points, points without tracks
// and with broken ones, files that are no photos.
#include "plugin/colmap/camera_rays.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/dataset/training_scene.h"
#include "plugin/photo/photo.h"

#include <map>

#include "tests/tools/program.h"
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

void WritePicture(const fs::path& path, const Image8& picture) {
  fs::create_directories(path.parent_path());
  const auto output = OIIO::ImageOutput::create(path.string());
  const OIIO::ImageSpec spec(picture.width, picture.height, 3, OIIO::TypeDesc::UINT8);
  ASSERT_TRUE(output && output->open(path.string(), spec) &&
              output->write_image(OIIO::TypeDesc::UINT8, picture.data.data()) && output->close());
}

constexpr uint32_t kLargeCamera = 70;
constexpr uint32_t kSmallCamera = 3;
constexpr uint32_t kIdleCamera = 9;

class OddWorkspaceTest : public testing::Test {
 protected:
  // Every third photo is by the small camera; all are named anew, so that names clash where they
  // can.
  OddWorkspaceTest() {
    model_ = ReadReconstruction(kTabletop / "sparse/0");
    const Camera large = model_.cameras[0];
    Camera small = RescaledCamera(large, 160, 120);
    small.id = kSmallCamera;
    Camera idle = large;
    idle.id = kIdleCamera;
    idle.model_id = FindCameraModel("FISHEYE")->id;
    idle.params = {200, 200, 160, 120};
    model_.cameras = {idle, large, small};
    model_.cameras[1].id = kLargeCamera;
    const PhotoSize half = {160, 120};
    for (size_t i = 0; i < model_.images.size(); ++i) {
      Image& image = model_.images[i];
      const fs::path source = kTabletop / "images" / image.name;
      const fs::path mask =
          kTabletop / "object_mask" / fs::path(image.name).replace_extension(".png");
      const std::string number = std::to_string(i / 3);
      if (i % 3 == 0) {
        image.camera_id = kSmallCamera;
        image.name = "right/" + number + ".png";
        for (Point2D& point : image.points) {
          point.x /= 2;
          point.y /= 2;
        }
        WritePicture(Images() / image.name, ReducePhoto(ReadPhoto(source), half));
      } else {
        image.camera_id = kLargeCamera;
        image.name = "left/day 1/" + number + (i % 3 == 1 ? ".jpg" : ".png");
        if (i % 3 == 1) {
          fs::create_directories((Images() / image.name).parent_path());
          fs::copy(source, Images() / image.name);
        } else {
          const Image8 photo = ReadPhoto(source);
          WritePicture(Images() / image.name, i == 2 ? ReducePhoto(photo, half) : photo);
        }
      }
      const fs::path target = Workspace() / "object_mask" / (image.name + ".png");
      fs::create_directories(target.parent_path());
      fs::copy(mask, target);
    }
    fs::copy(kTabletop / "images/0000.jpg", Images() / "not_registered.JPG");
    fs::copy(kTabletop / "images/0000.jpg", Images() / "left/0.jpg");
    WriteFile(Images() / "left/Thumbs.db", "no photo");
    WriteFile(Images() / "notes.txt", "nor this");
    WriteFile(Images() / ".hidden.jpg", "nor this");

    model_.images[7].points.clear();
    for (size_t i = 0; i < model_.points.size(); ++i) {
      Point3D& point = model_.points[i];
      std::erase_if(point.track, [&](const auto& e) { return e.image_id == model_.images[7].id; });
      if (i % 100 == 50) point.track.clear();
      if (i % 100 == 51) point.track[0].point2d_index = 1'000'000;
    }
    WriteReconstruction(Workspace() / "sparse/0", model_, ModelFormat::kBinary);
  }

  fs::path Workspace() const { return folder_ / "workspace"; }
  fs::path Images() const { return Workspace() / "images"; }
  std::string Out(const std::string& name) const { return (folder_ / name).string(); }

  TempFolder folder_;
  Reconstruction model_;
};

TEST_F(OddWorkspaceTest, EveryPhotoIsSeenByItsOwnCamera) {
  SceneOptions options;
  options.image_path = Images();
  options.input_path = Workspace();
  const TrainingScene scene(PlanScene(options));
  EXPECT_THAT(scene.PhotoReport(),
              ::testing::StartsWith("64 photos, 2 more not registered, 1 rescaled; "));
  EXPECT_THAT(scene.MaskReport(), HasSubstr("64 of 64 photos have a mask"));
  std::map<std::string, const Image*> images;
  for (const Image& image : model_.images) images[image.name] = &image;
  std::map<uint64_t, const Point3D*> points;
  for (const Point3D& point : model_.points) points[point.id] = &point;
  double sum = 0;
  int count = 0;
  for (int view = 0; view < scene.NumViews(); ++view) {
    const PhotoRecord& photo = scene.Photos()[view];
    const Image& image = *images.at(photo.name);
    const bool small = image.camera_id == kSmallCamera || photo.name == "left/day 1/0.png";
    EXPECT_EQ(scene.Width(view), small ? 160 : 320) << photo.name;
    EXPECT_EQ(scene.LabelIds(view).width, scene.Width(view));
    // Where the model's camera saw the points, in the pixels of the photo that there is.
    const double scale = scene.Width(view) / (image.camera_id == kSmallCamera ? 160.0 : 320.0);
    const Camera camera = CameraOf(photo, "the scene");
    const Pose pose = PoseOf(photo);
    for (const Point2D& seen : image.points) {
      if (!points.contains(seen.point3d_id)) continue;
      const Point3D& point = *points.at(seen.point3d_id);
      const auto pixel = Project(camera, pose.UnitRotation() * point.position + pose.translation);
      ASSERT_TRUE(pixel);
      sum += (*pixel - scale * Eigen::Vector2d(seen.x, seen.y)).norm();
      ++count;
    }
  }
  EXPECT_GT(count, 15'000);
  EXPECT_LT(sum / count, 0.5);
}

TEST_F(OddWorkspaceTest, TheWholeWayNothingIsMixedUp) {
  const Outcome run = RunSemfoam(TinyTraining({"foam_trainer",
                                               "--image_path",
                                               Images().string(),
                                               "--input_path",
                                               (Workspace() / "sparse").string(),
                                               "--output_path",
                                               Out("foam"),
                                               "--test_every",
                                               "8"}));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.Errors(), IsEmpty());
  EXPECT_THAT(run.err, HasSubstr("64 photos, 8 held out, 2 more not registered, 1 rescaled; "));
  EXPECT_THAT(run.err, HasSubstr("64 of 64 photos have a mask"));
  std::vector<std::string> render = {"foam_renderer",
                                     "--foam_path",
                                     Out("foam") + "/scene.foam",
                                     "--input_path",
                                     Workspace().string(),
                                     "--output_path",
                                     Out("renders"),
                                     "--views",
                                     "all"};
  // left/day 1/0.jpg and left/day 1/0.png would have one render.
  const Outcome clash = RunSemfoam(render);
  EXPECT_EQ(clash.exit_code, 1);
  EXPECT_THAT(clash.err, HasSubstr("has two images left/day 1/0.*, whose renders would have"));
  EXPECT_THAT(FilesBelow(Out("renders")), IsEmpty());

  render.back() = "test";
  const Outcome rendered = RunSemfoam(render);
  ASSERT_EQ(rendered.exit_code, 0) << rendered.err;
  EXPECT_EQ(FilesBelow(Out("renders")).size(), 8u * 3);
  const fs::path colours = fs::path(Out("renders")) / "rgb";
  EXPECT_EQ(ReadPhotoSize(colours / "left/day 1/0.png"), (PhotoSize{320, 240}));
  EXPECT_EQ(ReadPhotoSize(colours / "right/14.png"), (PhotoSize{160, 120}));

  const Outcome scores = RunSemfoam({"foam_evaluator",
                                     "--foam_path",
                                     Out("foam") + "/scene.foam",
                                     "--image_path",
                                     Images().string()});
  ASSERT_EQ(scores.exit_code, 0) << scores.err;
  EXPECT_THAT(scores.out, HasSubstr("\nleft/day 1/0.jpg "));
  EXPECT_THAT(scores.out, HasSubstr("\nright/21.png "));
}

}  // namespace
}  // namespace semfoam
