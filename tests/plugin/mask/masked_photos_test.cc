// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/masked_photos.h"

#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;
using testing::SizeIs;

// Two photos of 64 x 48 pixels, not in the order of their names, and a point that both see.
Reconstruction TwoPhotos() {
  Reconstruction model;
  Camera camera;
  camera.id = 1;
  camera.model_id = 1;
  camera.width = 64;
  camera.height = 48;
  camera.params = {50, 50, 32, 24};
  model.cameras = {camera};
  Image b;
  b.id = 3;
  b.camera_id = 1;
  b.name = "b.jpg";
  b.points = {{40, 12, 5}, {1, 1, kNoPoint3D}};
  Image a = b;
  a.id = 4;
  a.name = "a.jpg";
  a.points = {{10, 20, 5}};
  model.images = {b, a};
  Point3D point;
  point.id = 5;
  point.position = {0, 0, 1};
  point.track = {{3, 0}, {4, 0}};
  Point3D unseen = point;
  unseen.id = 6;
  unseen.track = {{4, 7}};  // a feature that is not there
  model.points = {point, unseen};
  return model;
}

// A mask whose right half is id 9 and whose left half is id 4.
void WriteHalves(const std::filesystem::path& path, int width, int height) {
  std::vector<uint8_t> pixels;
  for (int i = 0; i < width * height; ++i) pixels.push_back(i % width < width / 2 ? 4 : 9);
  WritePng(path, width, height, 8, PNG_COLOR_TYPE_GRAY, pixels);
}

MaskedPhotos Load(const TempFolder& folder, const Reconstruction* model) {
  const std::vector<PhotoRecord> photos = RegisteredPhotos(TwoPhotos());
  const MaskPairing pairing = PairMasks(folder.path(), {"a.jpg", "b.jpg"});
  return LoadMaskedPhotos(
      model, photos, pairing, folder.path(), LabelZero::kAuto, MaskConsistency::kAuto);
}

TEST(MaskedPhotos, RecordsAreSortedByNameAndHaveTheCamerasSize) {
  const std::vector<PhotoRecord> photos = RegisteredPhotos(TwoPhotos());
  ASSERT_THAT(photos, SizeIs(2));
  EXPECT_EQ(photos[0].name, "a.jpg");
  EXPECT_EQ(photos[1].name, "b.jpg");
  EXPECT_EQ(photos[1].width, 64);
  EXPECT_EQ(photos[1].height, 48);
}

TEST(MaskedPhotos, MasksOfPhotosBeforeUndistortionAreToldOf) {
  const TempFolder folder;
  WriteHalves(folder / "a.png", 64, 48);
  WriteHalves(folder / "b.png", 63, 48);
  const Reconstruction model = TwoPhotos();
  EXPECT_THAT(Load(folder, &model).size_warning,
              HasSubstr("b.png, 63 x 48 pixels for a photo of 64 x 48; "));
}

TEST(MaskedPhotos, MasksAreKeptAtTheSmallerSize) {
  const TempFolder folder;
  WriteHalves(folder / "a.png", 32, 24);
  WriteHalves(folder / "b.png", 128, 96);
  const Reconstruction model = TwoPhotos();
  const MaskedPhotos photos = Load(folder, &model);
  EXPECT_EQ(photos.photos[0].width, 32);
  EXPECT_EQ(photos.photos[0].height, 24);
  EXPECT_EQ(photos.photos[1].width, 64);
  EXPECT_EQ(photos.size_warning, "");
  ASSERT_THAT(photos.given.labels, SizeIs(2));
  const ClassImage a = photos.GivenMask(0), b = photos.GivenMask(1);
  EXPECT_EQ(a[15], ClassIndex{0});
  EXPECT_EQ(a[16], ClassIndex{1});
  EXPECT_EQ(b[31], ClassIndex{0});
  EXPECT_EQ(b[32], ClassIndex{1});
  EXPECT_THAT(photos.pixels[0],
              ElementsAre(Pair(ClassIndex{0}, 16 * 24), Pair(ClassIndex{1}, 16 * 24)));
  EXPECT_THAT(photos.pixels[1],
              ElementsAre(Pair(ClassIndex{0}, 32 * 48), Pair(ClassIndex{1}, 32 * 48)));
  // Observations are in pixels of these sizes, in the order of the track.
  ASSERT_THAT(photos.observations, SizeIs(2));
  ASSERT_THAT(photos.observations[0], SizeIs(2));
  EXPECT_EQ(photos.observations[0][0].view, 1);
  EXPECT_EQ(photos.observations[0][0].pixel, Eigen::Vector2d(40, 12));
  EXPECT_EQ(photos.observations[0][1].view, 0);
  EXPECT_EQ(photos.observations[0][1].pixel, Eigen::Vector2d(5, 10));
  EXPECT_THAT(photos.observations[1], SizeIs(0));
  // And what the masks show there: a radius of one pixel is all that is asked of the mask as it is.
  ASSERT_THAT(photos.shown, SizeIs(2));
  ASSERT_THAT(photos.shown[0], SizeIs(2));
  for (const int k : {0, 1}) {
    EXPECT_EQ(photos.shown[0][k].given_class, ClassIndex{1 - k});
    EXPECT_EQ(photos.shown[0][k].corrected_class, ClassIndex{1 - k});
    EXPECT_EQ(photos.shown[0][k].given_radius, 1);
    EXPECT_EQ(photos.shown[0][k].corrected_radius, 4);
  }
  EXPECT_THAT(photos.shown[1], SizeIs(0));
}

TEST(MaskedPhotos, AMaskThatChangesItsIdsIsAnError) {
  const TempFolder folder;
  WriteHalves(folder / "a.png", 64, 48);
  const MaskedPhotos photos = Load(folder, nullptr);
  WritePng(folder / "a.png", 64, 48, 8, PNG_COLOR_TYPE_GRAY, std::vector<uint8_t>(64 * 48, 4));
  EXPECT_THAT(UserErrorOf([&] { photos.GivenMask(0); }),
              HasSubstr("a.png: has changed its ids since it was first looked at"));
}

TEST(MaskedPhotos, WithoutAModelMasksAreBelieved) {
  const TempFolder folder;
  WriteHalves(folder / "a.png", 64, 48);
  const MaskedPhotos photos = Load(folder, nullptr);
  EXPECT_EQ(photos.consistency.used, MaskConsistency::kOff);
  EXPECT_THAT(photos.observations, SizeIs(0));
  EXPECT_THAT(photos.labels, SizeIs(2));
  EXPECT_EQ(photos.GivenMask(0)[40], ClassIndex{1});
  EXPECT_TRUE(photos.GivenMask(1).Empty());
}

TEST(MaskedPhotos, AMaskOfAnotherAspectIsAnError) {
  const TempFolder folder;
  WriteHalves(folder / "a.png", 32, 32);
  EXPECT_THAT(UserErrorOf([&] { Load(folder, nullptr); }),
              HasSubstr("a.png: is 32 x 32 pixels and its photo 64 x 48"));
}

}  // namespace
}  // namespace semfoam
