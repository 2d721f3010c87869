// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_undistortion.h"

#include "foam/util/json_file.h"
#include "foam/util/parallel.h"
#include "plugin/mask/label_png.h"
#include "plugin/mask/mask_png.h"
#include "plugin/mask/mask_tables.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "tests/mistake.h"
#include "tests/plugin/mask/grey_mask.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

Camera CameraOf(const std::string& model, int width, int height, std::vector<double> params) {
  Camera camera;
  camera.id = 1;
  camera.model_id = FindCameraModel(model)->id;
  camera.width = static_cast<uint64_t>(width);
  camera.height = static_cast<uint64_t>(height);
  camera.params = std::move(params);
  return camera;
}

// A model of photos of one camera, each turned by an angle that its name tells.
Reconstruction ModelOf(const Camera& camera, const std::vector<std::string>& names) {
  Reconstruction model;
  model.cameras = {camera};
  for (const std::string& name : names) {
    Image image;
    image.id = static_cast<uint32_t>(model.images.size()) + 1;
    image.camera_id = camera.id;
    image.name = name;
    image.cam_from_world.rotation =
        Eigen::AngleAxisd(0.3 * (name[0] - 'a'), Eigen::Vector3d::UnitY());
    model.images.push_back(image);
  }
  return model;
}

UndistortedPhotos PhotosOf(const Camera& original,
                           const Camera& undistorted,
                           const std::vector<std::string>& names) {
  return PairUndistorted(ModelOf(original, names), "I", ModelOf(undistorted, names), "U");
}

// The id of what is seen in a direction of the camera frame: fields of about ten degrees, 1 to 35.
int32_t IdSeen(const Eigen::Vector3d& ray) {
  const double azimuth = std::atan2(ray.x(), ray.z());
  const double elevation = std::atan2(ray.y(), std::hypot(ray.x(), ray.z()));
  const int column = static_cast<int>(std::floor(6 * azimuth + 0.3)) + 70;
  const int row = static_cast<int>(std::floor(6 * elevation + 0.4)) + 70;
  return 1 + 5 * (column % 7) + row % 5;
}

// What a camera sees at a place; none where it has no ray.
std::optional<int32_t> IdAt(const Camera& camera, double x, double y) {
  const std::optional<Eigen::Vector3d> ray = Unproject(camera, {x, y});
  if (!ray) return std::nullopt;
  return IdSeen(*ray);
}

// The exact mask of a camera.
LabelImage Paint(const Camera& camera) {
  LabelImage image{static_cast<int>(camera.width), static_cast<int>(camera.height), {}};
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      image.data.push_back(IdAt(camera, x + 0.5, y + 0.5).value_or(0));
    }
  }
  return image;
}

std::vector<int32_t> IdsIn(const fs::path& png) {
  const MaskPng mask = ReadMaskPng(png);
  return {mask.values.begin(), mask.values.end()};
}

const std::vector<Camera>& Lenses() {
  static const std::vector<Camera> lenses = {
      CameraOf("SIMPLE_PINHOLE", 320, 240, {250, 161, 118}),
      CameraOf("SIMPLE_RADIAL", 320, 240, {266.7, 160, 120, -0.2}),
      CameraOf("SIMPLE_RADIAL", 320, 240, {266.7, 160, 120, 0.15}),
      CameraOf("RADIAL", 320, 240, {266.7, 158, 121, -0.2, 0.04}),
      CameraOf("OPENCV", 320, 240, {266.7, 270, 157, 122, -0.25, 0.08, 0.004, -0.003}),
      CameraOf("OPENCV_FISHEYE", 320, 240, {200, 201, 160, 121, 0.02, 0.01, 0, 0}),
      CameraOf("FULL_OPENCV",
               320,
               240,
               {266, 265, 160, 120, -0.2, 0.05, 0.001, 0.002, 0.01, 0.02, 0.01, 0}),
      CameraOf("FOV", 320, 240, {200, 201, 160, 121, 0.9}),
      CameraOf("SIMPLE_RADIAL_FISHEYE", 320, 240, {200, 160, 120, 0.03}),
      CameraOf("RADIAL_FISHEYE", 320, 240, {200, 160, 120, 0.03, -0.01}),
      CameraOf("THIN_PRISM_FISHEYE",
               320,
               240,
               {200, 201, 160, 121, 0.02, 0.01, 0.001, 0.001, 0, 0, 0.001, 0.001}),
      CameraOf("SIMPLE_DIVISION", 320, 240, {266, 160, 120, -0.1}),
      CameraOf("DIVISION", 320, 240, {266, 265, 160, 120, -0.1}),
      CameraOf("SIMPLE_FISHEYE", 320, 240, {200, 160, 120}),
      CameraOf("FISHEYE", 320, 240, {200, 203, 160, 120}),
      CameraOf("EUCM", 320, 240, {266, 265, 160, 120, 0.6, 1.1}),
      CameraOf("EQUIRECTANGULAR", 640, 320, {640, 320}),
  };
  return lenses;
}

// A mask that is painted by what the distorted camera sees shows, undistorted, what the pinhole
// camera sees, wherever it is not at a border of two fields or of the photo.
TEST(MaskUndistortion, ShowsWhatTheUndistortedCameraSees) {
  const Camera pinhole = CameraOf("PINHOLE", 341, 256, {240, 238, 171.3, 127.2});
  for (const Camera& lens : Lenses()) {
    SCOPED_TRACE(FindCameraModel(lens.model_id)->name);
    const TempFolder temp;
    WriteLabelPng(temp / "masks/a.png", Paint(lens));
    const UndistortedPhotos photos = PhotosOf(lens, pinhole, {"a.jpg"});
    UndistortMasks(photos, temp / "masks", {}, temp / "out");
    const std::vector<int32_t> ids = IdsIn(temp / "out/a.png");
    ASSERT_EQ(ids.size(), size_t{341 * 256});
    int clear = 0, wrong = 0;
    for (int y = 0; y < 256; ++y) {
      for (int x = 0; x < 341; ++x) {
        const Eigen::Vector3d ray = *Unproject(pinhole, {x + 0.5, y + 0.5});
        const std::optional<Eigen::Vector2d> place = Project(lens, ray);
        ASSERT_TRUE(place);
        // The pixel that is read has its centre within half a pixel; a mistake of half a pixel more
        // would show.
        std::set<int32_t> around;
        for (const double dx : {-0.55, 0., 0.55}) {
          for (const double dy : {-0.55, 0., 0.55}) {
            const Eigen::Vector2d near = *place + Eigen::Vector2d(dx, dy);
            const bool is_inside = near.x() >= 0 && near.y() >= 0 &&
                                   near.x() < static_cast<double>(lens.width) &&
                                   near.y() < static_cast<double>(lens.height);
            around.insert(is_inside ? IdAt(lens, near.x(), near.y()).value_or(-1) : 0);
          }
        }
        if (around.size() != 1) continue;
        ++clear;
        const int32_t seen = *around.begin() == 0 ? 0 : IdSeen(ray);
        wrong += ids[static_cast<size_t>(y) * 341 + x] != seen;
      }
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(clear, 0.85 * 341 * 256);
  }
}

// Where image_undistorter has nothing to do, neither has this.
TEST(MaskUndistortion, EqualPinholeCamerasGiveTheSameBytes) {
  const TempFolder temp;
  const Camera camera = CameraOf("PINHOLE", 320, 240, {266.7, 270, 157, 122});
  WriteLabelPng(temp / "masks/a.png", Paint(camera));
  WriteLabelPng(temp / "masks/b/c.png", Paint(CameraOf("PINHOLE", 320, 240, {90, 95, 150, 100})));
  const UndistortedPhotos photos = PhotosOf(camera, camera, {"a.jpg", "b/c.jpg"});
  const MaskUndistortion result = UndistortMasks(photos, temp / "masks", {}, temp / "out");
  EXPECT_EQ(result.num_masks, 2);
  EXPECT_EQ(result.share_outside, 0);
  EXPECT_THAT(FilesBelow(temp / "out"),
              testing::UnorderedElementsAre("a.png", "b/c.png", "labels.json"));
  for (const char* name : {"a.png", "b/c.png"}) {
    EXPECT_EQ(ReadFile(temp / "out" / name), ReadFile(temp / "masks" / name)) << name;
  }
  // Its own results are replaced.
  UndistortMasks(photos, temp / "masks", {}, temp / "out");
  EXPECT_EQ(ReadFile(temp / "out/a.png"), ReadFile(temp / "masks/a.png"));
}

TEST(MaskUndistortion, SameBytesOnAnyNumberOfThreads) {
  const TempFolder temp;
  const Camera lens = Lenses()[4];
  std::vector<std::string> names;
  for (int i = 0; i < 7; ++i) {
    names.push_back("photo " + std::to_string(i) + ".jpg");
    LabelImage image = Paint(lens);
    std::rotate(image.data.begin(), image.data.begin() + 3000 * i, image.data.end());
    WriteLabelPng(temp / "masks" / ("photo " + std::to_string(i) + ".png"), image);
  }
  const UndistortedPhotos photos =
      PhotosOf(lens, CameraOf("PINHOLE", 341, 256, {240, 238, 171.3, 127.2}), names);
  std::map<std::string, std::string> bytes;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    const fs::path out = temp / std::to_string(threads);
    UndistortMasks(photos, temp / "masks", {}, out);
    const std::vector<std::string> files = FilesBelow(out);
    EXPECT_EQ(files.size(), 8u);
    for (const std::string& file : files) {
      const std::string& first = bytes.emplace(file, ReadFile(out / file)).first->second;
      EXPECT_EQ(ReadFile(out / file), first) << file << " on " << threads << " threads";
    }
  }
}

// A photo of 4 x 2 pixels, of which the undistorted one shows more on all sides.
constexpr int kWide = 6;
Camera Small() { return CameraOf("PINHOLE", 4, 2, {5, 5, 2, 1}); }
Camera SmallWithRim() { return CameraOf("PINHOLE", kWide, 4, {5, 5, 3, 1}); }

TEST(MaskUndistortion, OutsideOfThePhotoIsZero) {
  const TempFolder temp;
  WriteGrey(temp / "masks/a.png", {1, 2, 3, 4, 5, 6, 7, 8});
  const UndistortedPhotos photos = PhotosOf(Small(), SmallWithRim(), {"a.jpg"});
  const MaskUndistortion result = UndistortMasks(photos, temp / "masks", {}, temp / "out");
  EXPECT_THAT(IdsIn(temp / "out/a.png"),
              ElementsAre(0,
                          1,
                          2,
                          3,
                          4,
                          0,  //
                          0,
                          5,
                          6,
                          7,
                          8,
                          0,  //
                          0,
                          0,
                          0,
                          0,
                          0,
                          0,  //
                          0,
                          0,
                          0,
                          0,
                          0,
                          0));
  EXPECT_NEAR(result.share_outside, 16. / 24, 1e-12);
  EXPECT_FALSE(result.zero_is_class);
  // Though it is most of the new mask, 0 was no class of the old one.
  EXPECT_TRUE(SaysZeroIsUnlabelled(temp / "out"));
  EXPECT_EQ(SourcePixel(photos.photos[0], {4, 2}, 0, 0), kOutsideOfPhoto);
  EXPECT_EQ(SourcePixel(photos.photos[0], {4, 2}, 1, 1), 4);
}

TEST(MaskUndistortion, ABackgroundStaysOne) {
  const TempFolder temp;
  WriteGrey(temp / "masks/a.png", {0, 0, 3, 3, 0, 0, 7, 7});
  const UndistortedPhotos photos = PhotosOf(Small(), SmallWithRim(), {"a.jpg"});
  const MaskUndistortion result = UndistortMasks(photos, temp / "masks", {}, temp / "out");
  EXPECT_TRUE(result.zero_is_class);
  EXPECT_FALSE(SaysZeroIsUnlabelled(temp / "out"));
  // Unless its labels.json says otherwise.
  WriteFile(temp / "masks/labels.json", R"({"labels": {}, "label_zero": "ignore"})");
  EXPECT_FALSE(UndistortMasks(photos, temp / "masks", {}, temp / "out").zero_is_class);
  EXPECT_TRUE(SaysZeroIsUnlabelled(temp / "out"));
}

TEST(MaskUndistortion, MasksOfOtherSizesAreReadAtTheNearestPixel) {
  const TempFolder temp;
  // Masks of half and of twice the size of photos of 8 x 4 and 2 x 1 pixels.
  WriteGrey(temp / "masks/a.png", {1, 2, 3, 4, 5, 6, 7, 8});
  const Camera large = CameraOf("PINHOLE", 8, 4, {5, 5, 4, 2});
  UndistortMasks(PhotosOf(large, large, {"a.jpg"}), temp / "masks", {}, temp / "large");
  EXPECT_THAT(IdsIn(temp / "large/a.png"),
              ElementsAre(1,
                          1,
                          2,
                          2,
                          3,
                          3,
                          4,
                          4,  //
                          1,
                          1,
                          2,
                          2,
                          3,
                          3,
                          4,
                          4,  //
                          5,
                          5,
                          6,
                          6,
                          7,
                          7,
                          8,
                          8,  //
                          5,
                          5,
                          6,
                          6,
                          7,
                          7,
                          8,
                          8));
  const Camera tiny = CameraOf("PINHOLE", 2, 1, {5, 5, 1, 0.5});
  UndistortMasks(PhotosOf(tiny, tiny, {"a.jpg"}), temp / "masks", {}, temp / "tiny");
  EXPECT_THAT(IdsIn(temp / "tiny/a.png"), ElementsAre(6, 8));
}

// In photos that image_undistorter halved, the centres of pixels are corners of the original ones,
// which must not be left to rounding.
TEST(MaskUndistortion, HalvedPhotosShowTheSameCornerOfAllPixels) {
  const UndistortedPhotos photos =
      PhotosOf(CameraOf("PINHOLE", 300, 200, {266.7, 270.3, 149.3, 101.1}),
               CameraOf("PINHOLE", 150, 100, {133.35, 135.15, 74.65, 50.55}),
               {"a.jpg"});
  int wrong = 0;
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 150; ++x) {
      wrong += SourcePixel(photos.photos[0], {300, 200}, x, y) != (2 * y + 1) * 300 + 2 * x + 1;
    }
  }
  EXPECT_EQ(wrong, 0);
}

TEST(MaskUndistortion, LongIdsAreNumberedAndKeepTheirNames) {
  const TempFolder temp;
  std::vector<uint8_t> rgb;
  for (int i = 0; i < 8; ++i) {
    const std::vector<uint8_t> pixel = {static_cast<uint8_t>(i < 4 ? 10 : 200), 3, 7};
    rgb.insert(rgb.end(), pixel.begin(), pixel.end());
  }
  WritePng(temp / "masks/a.png", 4, 2, 8, PNG_COLOR_TYPE_RGB, rgb);
  const int id = 10 + 3 * 256 + 7 * 65536;
  WriteFile(temp / "labels.json",
            R"({"labels": {")" + std::to_string(id) + R"(": "mug", "5": "none"}})");
  const MaskUndistortion result = UndistortMasks(
      PhotosOf(Small(), Small(), {"a.jpg"}), temp / "masks", temp / "labels.json", temp / "out");
  EXPECT_EQ(result.num_renumbered, 2);
  EXPECT_THAT(IdsIn(temp / "out/a.png"), ElementsAre(1, 1, 1, 1, 2, 2, 2, 2));
  EXPECT_EQ(ReadJsonFile(temp / "out/labels.json")["original_ids"],
            (nlohmann::json{{"1", id}, {"2", 200 + 3 * 256 + 7 * 65536}}));
  const std::vector<LabelName> names = ReadLabelNames(temp / "out/labels.json");
  ASSERT_EQ(names.size(), 1u);
  EXPECT_EQ(names[0].id, LabelId{1});
  EXPECT_EQ(names[0].source_id, MaskId{1});
  EXPECT_EQ(names[0].name, "mug");
}

TEST(MaskUndistortion, NamesOfIdsAreKept) {
  const TempFolder temp;
  WriteGrey(temp / "masks/a.png", {0, 7, 7, 7, 9, 9, 9, 9});
  WriteFile(temp / "labels.json", R"({"labels": {"0": "nothing", "7": "mug", "8": "plant"}})");
  UndistortMasks(
      PhotosOf(Small(), Small(), {"a.jpg"}), temp / "masks", temp / "labels.json", temp / "out");
  std::map<int, std::string> names;
  for (const LabelName& name : ReadLabelNames(temp / "out/labels.json")) {
    names.emplace(Value(name.id), name.name);
  }
  EXPECT_THAT(names, ElementsAre(Pair(0, "nothing"), Pair(7, "mug"), Pair(8, "plant")));
  EXPECT_FALSE(ReadJsonFile(temp / "out/labels.json").contains("original_ids"));
}

TEST(MaskUndistortion, TellsOfPhotosAndMasksOfOneModelAlone) {
  const TempFolder temp;
  for (const char* name : {"a", "b", "c", "x"}) {
    WriteGrey(temp / "masks" / (std::string(name) + ".png"), {1, 2, 3, 4, 5, 6, 7, 8});
  }
  Reconstruction undistorted = ModelOf(Small(), {"a.jpg", "d.jpg", "e.jpg"});
  const UndistortedPhotos photos =
      PairUndistorted(ModelOf(Small(), {"a.jpg", "b.jpg", "c.jpg"}), "I", undistorted, "U");
  ASSERT_EQ(photos.photos.size(), 1u);
  EXPECT_THAT(photos.only_original, ElementsAre("b.jpg", "c.jpg"));
  EXPECT_THAT(photos.only_undistorted, ElementsAre("d.jpg", "e.jpg"));
  const MaskUndistortion result = UndistortMasks(photos, temp / "masks", {}, temp / "out");
  EXPECT_EQ(result.num_masks, 1);
  EXPECT_THAT(result.without_photo, testing::UnorderedElementsAre("b.png", "c.png", "x.png"));
  EXPECT_THAT(FilesBelow(temp / "out"), testing::UnorderedElementsAre("a.png", "labels.json"));
  fs::remove(temp / "masks/a.png");
  EXPECT_THAT(UserErrorOf([&] { UndistortMasks(photos, temp / "masks", {}, temp / "none"); }),
              NamesMistake("masks", {"a.jpg"}, "no mask is of a photo"));
}

TEST(MaskUndistortion, RefusesModelsThatAreNotBeforeAndAfter) {
  const Camera lens = CameraOf("SIMPLE_RADIAL", 4, 2, {5, 2, 1, -0.1});
  const auto error = [&](const Reconstruction& original, const Reconstruction& undistorted) {
    return UserErrorOf([&] { PairUndistorted(original, "I", undistorted, "U"); });
  };
  const Reconstruction original = ModelOf(lens, {"a.jpg", "b.jpg"});
  EXPECT_EQ(error(original, ModelOf(Small(), {"b.jpg"})), "");
  EXPECT_THAT(error(original, ModelOf(Small(), {"c.jpg"})),
              NamesMistake("U", {"I"}, "has no photo of"));
  // The two models in each other's place.
  EXPECT_THAT(error(ModelOf(Small(), {"a.jpg"}), ModelOf(lens, {"a.jpg"})),
              NamesMistake("U", {"a.jpg", "SIMPLE_RADIAL", "PINHOLE"}, "has distortion"));
  // A SIMPLE_RADIAL camera without distortion is left as it is by image_undistorter.
  const Camera straight = CameraOf("SIMPLE_RADIAL", 4, 2, {5, 2, 1, 0});
  EXPECT_EQ(error(ModelOf(straight, {"a.jpg"}), ModelOf(straight, {"a.jpg"})), "");
  const auto turned = [](double angle) {
    Reconstruction model = ModelOf(Small(), {"a.jpg", "b.jpg"});
    Eigen::Quaterniond& rotation = model.images[1].cam_from_world.rotation;
    rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()) * rotation;
    // As far from unit length as models may be; and of the opposite sign, the same rotation.
    rotation.coeffs() *= -1.0005;
    return model;
  };
  EXPECT_EQ(error(original, turned(1e-6)), "");
  EXPECT_THAT(error(original, turned(0.01)),
              NamesMistake("U", {"b.jpg", "0.572958 degrees", "I"}, "is turned by"));
}

TEST(MaskUndistortion, RefusesMasksOfOtherPhotos) {
  const TempFolder temp;
  const Camera lens = CameraOf("SIMPLE_RADIAL", 40, 20, {50, 20, 10, -0.1});
  const UndistortedPhotos photos =
      PhotosOf(lens, CameraOf("PINHOLE", 39, 19, {50, 50, 20, 10}), {"a.jpg", "b.jpg"});
  const auto error = [&](const PhotoSize& size) {
    const std::vector<uint8_t> ids(static_cast<size_t>(size.width) * size.height, 1);
    WritePng(temp / "masks/b.png", size.width, size.height, 8, PNG_COLOR_TYPE_GRAY, ids);
    const std::string said =
        UserErrorOf([&] { UndistortMasks(photos, temp / "masks", {}, temp / "out"); });
    EXPECT_THAT(FilesBelow(temp / "out"), said.empty() ? testing::SizeIs(2) : testing::SizeIs(0));
    fs::remove_all(temp / "out");
    return said;
  };
  EXPECT_EQ(error({40, 20}), "");
  EXPECT_EQ(error({20, 10}), "");
  EXPECT_EQ(error({80, 40}), "");
  EXPECT_THAT(error({39, 19}),
              NamesMistake("masks/b.png", {"39 x 19", "40 x 20"}, "as the undistorted photo"));
  EXPECT_THAT(error({40, 40}),
              NamesMistake("masks/b.png", {"40 x 40", "40 x 20"}, "a mask of the original photo"));
}

TEST(MaskUndistortion, LeavesOtherFilesAlone) {
  const TempFolder temp;
  WriteGrey(temp / "masks/a.png", {1, 2, 3, 4, 5, 6, 7, 8});
  const UndistortedPhotos photos = PhotosOf(Small(), Small(), {"a.jpg", "b.jpg"});
  const auto error = [&](const fs::path& output) {
    return UserErrorOf([&] { UndistortMasks(photos, temp / "masks", {}, output); });
  };
  const std::string mask = ReadFile(temp / "masks/a.png");
  EXPECT_THAT(error(temp / "masks/../masks"),
              NamesMistake("masks/../masks", {}, "folder of the masks themselves"));
  EXPECT_EQ(ReadFile(temp / "masks/a.png"), mask);
  WriteFile(temp / "names/labels.json", R"({"labels": {"7": "mine"}})");
  EXPECT_THAT(error(temp / "names"), NamesMistake("names/labels.json", {}, "would be lost"));
  WriteFile(temp / "pngs/a.png", "mine");
  EXPECT_THAT(error(temp / "pngs"), NamesMistake("pngs/a.png", {}, "mixed up"));
  EXPECT_EQ(ReadFile(temp / "pngs/a.png"), "mine");
  // A damaged mask leaves nothing.
  WriteFile(temp / "masks/b.png", mask.substr(0, mask.size() - 20));
  EXPECT_THAT(error(temp / "bad"), testing::HasSubstr("masks/b.png: "));
  EXPECT_THAT(FilesBelow(temp / "bad"), IsEmpty());
}

TEST(MaskUndistortion, IgnoredPixelsAreBlackAndAllElseIsWhite) {
  const TempFolder temp;
  WriteGrey(temp / "masks/a_mask.png", {0, 255, 1, 0, 0, 0, 9, 9});
  const UndistortedPhotos photos = PhotosOf(Small(), SmallWithRim(), {"a.jpg", "b.jpg"});
  const auto undistort = [&](bool inverted, const char* output) {
    const MaskUndistortion result = UndistortIgnoredPixels(
        photos, temp / "masks", {temp / "masks/a_mask.png", ""}, inverted, temp / output);
    EXPECT_EQ(result.num_masks, 1);
    EXPECT_NEAR(result.share_outside, 16. / 24, 1e-12);
    return IdsIn(temp / output / "a.jpg.png");
  };
  constexpr int kWhite = 65535;
  const std::vector<int32_t> plain = {0, 0, kWhite, kWhite, 0,      0,  //
                                      0, 0, 0,      kWhite, kWhite, 0,  //
                                      0, 0, 0,      0,      0,      0,  //
                                      0, 0, 0,      0,      0,      0};
  EXPECT_EQ(undistort(false, "out"), plain);
  const std::vector<int32_t> inverted = {0, kWhite, 0,      0, kWhite, 0,  //
                                         0, kWhite, kWhite, 0, 0,      0,  //
                                         0, 0,      0,      0, 0,      0,  //
                                         0, 0,      0,      0, 0,      0};
  EXPECT_EQ(undistort(true, "inverted"), inverted);
}

}  // namespace
}  // namespace semfoam
