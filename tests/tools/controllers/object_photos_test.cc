// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/object_photos.h"

#include "foam/util/error.h"
#include "foam/util/parallel.h"

#include <cmath>

#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A photo from `center`, in the frame of the model, that looks along `forward`.
PhotoRecord PhotoFrom(const std::string& name,
                      const Eigen::Vector3d& center,
                      const Eigen::Vector3d& forward) {
  PhotoRecord photo;
  photo.name = name;
  photo.camera_model = "SIMPLE_PINHOLE";
  photo.width = 400;
  photo.height = 300;
  photo.camera_params = {400, 200, 150};
  photo.cam_from_world_rotation =
      Eigen::Quaterniond::FromTwoVectors(forward, Eigen::Vector3d::UnitZ());
  photo.cam_from_world_translation = -(photo.cam_from_world_rotation * center);
  return photo;
}

// Two balls of radius 0.3 (1.2 in the world) that touch: 7 at the left, 8 at the right.
Model BallsWithPhotos() {
  Model model = TouchingBalls(20000);
  model.world_from_normalized = {4, {5e5, 4.5e6, 100}};
  const Eigen::Vector3d middle = model.world_from_normalized.translation;
  const auto at = [&](double x, double y, double z) -> Eigen::Vector3d {
    return middle + Eigen::Vector3d(x, y, z);
  };
  model.photos = {
      PhotoFrom("far.jpg", at(0, 0, -12), Eigen::Vector3d::UnitZ()),
      PhotoFrom("from the left.jpg", at(-12, 0, 0), Eigen::Vector3d::UnitX()),
      PhotoFrom("near.jpg", at(0, 0, -6), Eigen::Vector3d::UnitZ()),
      PhotoFrom("away.jpg", at(0, 0, -6), -Eigen::Vector3d::UnitZ()),
  };
  model.photos[2].held_out = true;
  return model;
}

TEST(ObjectPhotos, AreThoseThatShowTheObjectByPixels) {
  const Model model = BallsWithPhotos();
  ExportableScene scene = MakeExportableScene(model);
  FindPhotosOfObjects(model, "scene.foam", &scene);
  ASSERT_EQ(scene.objects.size(), 2u);
  const auto names = [&](int object) {
    std::vector<std::string> names;
    for (const PhotoObservation& s : scene.objects[object].photos) names.push_back(s.photo);
    return names;
  };
  // The left ball hides the right one from the left.
  EXPECT_THAT(names(0), testing::ElementsAre("near.jpg", "from the left.jpg", "far.jpg"));
  EXPECT_THAT(names(1), testing::ElementsAre("near.jpg", "far.jpg"));
  // The outline of a ball of radius 1.2 around 1.2 beside the axis, with a focal length of 400: an
  // ellipse hardly larger than this circle. Cells stick out of it.
  const double far_pixels = M_PI * std::pow(400 * 1.2 / std::sqrt(144 - 1.44), 2);
  for (const ObjectInfo& object : scene.objects) {
    const PhotoObservation& last = object.photos.back();
    EXPECT_EQ(last.photo, "far.jpg");
    EXPECT_NEAR(static_cast<double>(last.pixels), far_pixels, 0.25 * far_pixels);
    EXPECT_GT(object.photos.front().pixels, 3 * last.pixels);
  }
}

TEST(ObjectPhotos, AreTheSameOnAnyNumberOfThreads) {
  const Model model = BallsWithPhotos();
  std::vector<std::vector<PhotoObservation>> first;
  for (const int threads : {1, 3, -1}) {
    const ThreadLimit limit(threads);
    ExportableScene scene = MakeExportableScene(model);
    FindPhotosOfObjects(model, "scene.foam", &scene);
    for (size_t k = 0; k < scene.objects.size(); ++k) {
      if (threads == 1) first.push_back(scene.objects[k].photos);
      ASSERT_EQ(scene.objects[k].photos.size(), first[k].size());
      for (size_t i = 0; i < first[k].size(); ++i) {
        EXPECT_EQ(scene.objects[k].photos[i].photo, first[k][i].photo);
        EXPECT_EQ(scene.objects[k].photos[i].pixels, first[k][i].pixels);
      }
    }
  }
}

// Matter that is no object's stands in the way; glass does not.
TEST(ObjectPhotos, AWallHidesWhatIsBehindIt) {
  Model model = BallsWithPhotos();
  model.labels[1].id = kNoObject;
  ExportableScene scene = MakeExportableScene(model);
  model.photos = {PhotoFrom("from the right.jpg",
                            model.world_from_normalized.translation + Eigen::Vector3d(12, 0, 0),
                            -Eigen::Vector3d::UnitX())};
  FindPhotosOfObjects(model, "scene.foam", &scene);
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_THAT(scene.objects[0].photos, IsEmpty());
  // 30 % of the light is lost across the right ball.
  for (size_t i = 0; i < model.foam.NumSites(); ++i) {
    if ((model.foam.positions[i] - Eigen::Vector3f(0.3f, 0, 0)).norm() >= 0.3f) continue;
    model.foam.raw_density[i] = static_cast<float>(RawDensity(0.6));
  }
  scene = MakeExportableScene(model);
  FindPhotosOfObjects(model, "scene.foam", &scene);
  EXPECT_EQ(scene.objects[0].photos.size(), 1u);
}

TEST(ObjectPhotos, WithoutPhotosOrObjectsThereAreNone) {
  Model model = BallsWithPhotos();
  model.photos.clear();
  ExportableScene scene = MakeExportableScene(model);
  FindPhotosOfObjects(model, "scene.foam", &scene);
  EXPECT_THAT(scene.objects[0].photos, IsEmpty());
}

TEST(ObjectPhotos, ACameraWithoutRaysIsAUserError) {
  Model model = BallsWithPhotos();
  model.photos[1].camera_model = "NO_SUCH_CAMERA";
  ExportableScene scene = MakeExportableScene(model);
  try {
    FindPhotosOfObjects(model, "some.foam", &scene);
    FAIL();
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), HasSubstr("some.foam"));
  }
}

}  // namespace
}  // namespace semfoam
