// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/images/view_images.h"

#include "export/scene/names.h"
#include "foam/util/error.h"
#include "plugin/mask/label_png.h"
#include "tools/images/image_files.h"

#include <memory>
#include <utility>

#include "tests/tools/program.h"
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(ViewImages, ColoursAreCutAndRounded) {
  RenderedView view;
  view.width = 2;
  view.height = 1;
  view.color = {Eigen::Vector3f(-0.5f, 0.5f, 1.5f), Eigen::Vector3f(0, 1, 0.999f)};
  EXPECT_THAT(ColorImage(view).data, ElementsAre(0, 128, 255, 0, 255, 255));
}

TEST(ViewImages, IdsAreTheLabelsAndNotTheClasses) {
  RenderedView view;
  view.width = 3;
  view.height = 1;
  view.class_index = {ClassIndex{1}, kUnlabelled, ClassIndex{0}};
  std::vector<Label> labels(2);
  labels[0].id = LabelId{7};
  labels[1].id = LabelId{40000};
  EXPECT_THAT(LabelIdImage(view, labels).data, ElementsAre(40000, 0, 7));
}

TEST(ViewImages, DepthIsAlongTheCameraAxisInWorldUnits) {
  RenderedView view;
  view.width = 3;
  view.height = 1;
  view.distance = {2, 2, 0};
  CameraRays rays;
  rays.width = 3;
  rays.height = 1;
  rays.directions = {
      Eigen::Vector3f::UnitX(), Eigen::Vector3f(0.6f, 0.8f, 0), Eigen::Vector3f::UnitX()};
  const std::vector<float> depth = DepthImage(view, rays, Eigen::Vector3d::UnitX(), 10);
  EXPECT_FLOAT_EQ(depth[0], 20);
  EXPECT_FLOAT_EQ(depth[1], 12);
  EXPECT_EQ(depth[2], 0);
}

TEST(ViewImages, PicturesStandSideBySideRowByRow) {
  const Image8 left{1, 2, {1, 1, 1, 2, 2, 2}};
  const Image8 right{2, 2, {3, 3, 3, 4, 4, 4, 5, 5, 5, 6, 6, 6}};
  const Image8 both = SideBySide({left, right});
  EXPECT_EQ(both.width, 3);
  EXPECT_THAT(both.data, ElementsAre(1, 1, 1, 3, 3, 3, 4, 4, 4, 2, 2, 2, 5, 5, 5, 6, 6, 6));
}

TEST(ViewImages, PaletteIsThatOfTheLabels) {
  const Image8 image = PaletteImage({2, 1, {0, 7}});
  const auto color = LabelColor(LabelId{7});
  EXPECT_THAT(image.data, ElementsAre(0, 0, 0, color[0], color[1], color[2]));
}

TEST(ViewImages, NearestResizingKeepsIdsAndEdges) {
  const LabelImage ids{2, 2, {1, 2, 3, 4}};
  EXPECT_THAT(ResizeNearest(ids, 4, 2).data, ElementsAre(1, 1, 2, 2, 3, 3, 4, 4));
  EXPECT_THAT(ResizeNearest(ids, 1, 1).data, ElementsAre(1));
  const Image8 image{1, 1, {9, 8, 7}};
  EXPECT_THAT(ResizeNearest(image, 2, 1).data, ElementsAre(9, 8, 7, 9, 8, 7));
}

TEST(ViewImages, ErrorsGrowBrighterFromBlackToWhite) {
  const int steps = kWhiteError + 10;
  Image8 render{steps, 1, {}};
  Image8 photo{steps, 1, {}};
  for (int error = 0; error < steps; ++error) {
    // Either sign, and shared unevenly among the channels.
    const auto by = static_cast<uint8_t>(error);
    for (const int value : {100 + by, 100 - by, 100 + by}) render.data.push_back(value);
    photo.data.insert(photo.data.end(), 3, 100);
  }
  const Image8 image = ErrorImage(render, photo);
  double last = -1;
  for (int x = 0; x < steps; ++x) {
    const uint8_t* color = &image.data[3 * x];
    const double luminance = 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
    if (x <= kWhiteError) {
      EXPECT_GT(luminance, last) << x;
    } else {
      EXPECT_DOUBLE_EQ(luminance, 255) << x;
    }
    last = luminance;
  }
  EXPECT_THAT(std::vector<uint8_t>(image.data.begin(), image.data.begin() + 3),
              ElementsAre(0, 0, 0));
}

TEST(ViewImagesFiles, LabelsKeepAllSixteenBits) {
  const TempFolder folder;
  const LabelImage ids{3, 1, {0, 256, 65535}};
  WriteLabelPng(folder / "a/b.png", ids);
  const auto input = OIIO::ImageInput::open((folder / "a/b.png").string());
  ASSERT_NE(input, nullptr);
  EXPECT_EQ(input->spec().format, OIIO::TypeDesc::UINT16);
  EXPECT_EQ(input->spec().nchannels, 1);
  std::vector<uint16_t> values(3);
  ASSERT_TRUE(input->read_image(0, 0, 0, 1, OIIO::TypeDesc::UINT16, values.data()));
  EXPECT_THAT(values, ElementsAre(0, 256, 65535));
}

TEST(ViewImagesFiles, DepthKeepsItsFloats) {
  const TempFolder folder;
  WriteDepthExr(folder / "d.exr", 2, 1, {0, 1.2345678f});
  const auto input = OIIO::ImageInput::open((folder / "d.exr").string());
  ASSERT_NE(input, nullptr);
  std::vector<float> values(2);
  ASSERT_TRUE(input->read_image(0, 0, 0, 1, OIIO::TypeDesc::FLOAT, values.data()));
  EXPECT_THAT(values, ElementsAre(0, 1.2345678f));
}

TEST(ViewImagesFiles, ForegroundIsWhatIsBrighterThanHalf) {
  const TempFolder folder;
  WriteRgbPng(folder / "mask.png", {3, 1, {0, 0, 0, 128, 128, 128, 255, 255, 255}});
  EXPECT_THAT(ReadForeground(folder / "mask.png").mask.data, ElementsAre(0, 0, 1));
}

TEST(ViewImagesFiles, ForegroundOfZerosAndOnesIsWhereTheOnesAre) {
  const TempFolder folder;
  // 8 and 16 bits.
  WriteRgbPng(folder / "8.png", {3, 1, {0, 0, 0, 1, 1, 1, 0, 0, 0}});
  WriteLabelPng(folder / "16.png", {3, 1, {0, 1, 0}});
  for (const auto& [name, white] : {std::pair("8.png", 255), std::pair("16.png", 65535)}) {
    const Foreground foreground = ReadForeground(folder / name);
    EXPECT_THAT(foreground.mask.data, ElementsAre(0, 1, 0)) << name;
    EXPECT_EQ(foreground.largest, 1);
    EXPECT_EQ(foreground.white, white);
  }
  WriteLabelPng(folder / "16.png", {3, 1, {0, 65535, 1}});
  EXPECT_THAT(ReadForeground(folder / "16.png").mask.data, ElementsAre(0, 1, 0));
  // Neither white nor one: nobody can tell.
  WriteLabelPng(folder / "16.png", {3, 1, {0, 255, 1}});
  EXPECT_THAT(ReadForeground(folder / "16.png").mask.data, ElementsAre(0, 0, 0));
  EXPECT_EQ(ReadForeground(folder / "16.png").largest, 255);
  WriteRgbPng(folder / "8.png", {2, 1, {0, 0, 0, 7, 7, 7}});
  EXPECT_THAT(ReadForeground(folder / "8.png").mask.data, ElementsAre(0, 0));
  EXPECT_EQ(ReadForeground(folder / "8.png").largest, 7);
}

TEST(ViewImagesFiles, KnowsItsOwn) {
  const TempFolder folder;
  WriteRgbPng(folder / "rgb.png", {1, 1, {1, 2, 3}});
  WriteLabelPng(folder / "label.png", {1, 1, {7}});
  WriteDepthExr(folder / "depth.exr", 1, 1, {1});
  for (const char* name : {"rgb.png", "label.png", "depth.exr"}) {
    EXPECT_TRUE(IsOwnImage(folder / name)) << name;
  }
  WriteFile(folder / "no.png", "no image");
  fs::create_directories(folder / "folder.png");
  for (const fs::path& path : {kTabletop / "object_mask/0000.png",
                               kTabletop / "images/0000.jpg",
                               folder / "no.png",
                               folder / "folder.png",
                               folder / "missing.png"}) {
    EXPECT_FALSE(IsOwnImage(path)) << path;
  }
}

TEST(ViewImagesFiles, SaysWhichFileItCannotReadOrWrite) {
  const TempFolder folder;
  WriteFile(folder / "mask.png", "no image");
  for (const char* name : {"mask.png", "missing.png"}) {
    try {
      ReadForeground(folder / name);
      ADD_FAILURE() << name;
    } catch (const UserError& error) {
      EXPECT_THAT(error.what(), HasSubstr(name));
    }
  }
  EXPECT_THROW(WriteRgbPng(folder / "mask.png" / "x.png", {1, 1, {0, 0, 0}}), UserError);
}

TEST(ViewImages, PutInLightDarkensAsTheLensDoes) {
  RenderedView view;
  view.width = 40;
  view.height = 30;
  view.color.assign(1200, Eigen::Vector3f(0.5f, 0.4f, 0.3f));
  PhotoLight light;
  light.gain = {1.2, 1, 1};
  light.falloff = {-0.4, 0};
  PutInLight(light, &view);
  EXPECT_LT((view.color[15 * 40 + 20] -
             PhotographedColor({0.5f, 0.4f, 0.3f}, light, PlaceInPhoto({20.5, 15.5}, 40, 30)))
                .norm(),
            1e-6f);
  EXPECT_GT(view.color[15 * 40 + 20].x(), 0.53f);
  EXPECT_NEAR(view.color[15 * 40 + 20].y(), 0.4f, 1e-3f);
  // All corners alike.
  for (const int corner : {39, 29 * 40, 1199}) {
    EXPECT_LT((view.color[corner] - view.color[0]).norm(), 1e-6f) << corner;
  }
  EXPECT_LT(view.color[0].y(), 0.35f);
}

}  // namespace
}  // namespace semfoam
