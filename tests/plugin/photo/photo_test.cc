// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photo/photo.h"

#include <cstring>

#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

const fs::path kPhoto = fs::path(SEMFOAM_TEST_DATA) / "tabletop/images/0000.jpg";

std::string PhotoErrorOf(const fs::path& path) {
  return UserErrorOf([&] { ReadPhoto(path); });
}

TEST(Photo, ReadsAJpeg) {
  EXPECT_EQ(ReadPhotoSize(kPhoto), (PhotoSize{320, 240}));
  const Image8 photo = ReadPhoto(kPhoto);
  EXPECT_EQ(photo.width, 320);
  EXPECT_EQ(photo.height, 240);
  ASSERT_EQ(photo.data.size(), 3u * 320 * 240);
  const auto [darkest, brightest] = std::minmax_element(photo.data.begin(), photo.data.end());
  EXPECT_LT(*darkest, 60);
  EXPECT_GT(*brightest, 180);
}

TEST(Photo, EveryCutOfAJpegIsNamed) {
  TempFolder temp;
  const std::string bytes = ReadFile(kPhoto);
  const fs::path cut = temp / "cut.jpg";
  std::vector<size_t> sizes;
  for (int percent = 0; percent < 100; percent += 5) sizes.push_back(bytes.size() * percent / 100);
  for (int percent = 91; percent < 100; ++percent) sizes.push_back(bytes.size() * percent / 100);
  for (const size_t missing : {1, 2, 3, 10, 100}) sizes.push_back(bytes.size() - missing);
  for (const size_t size : sizes) {
    WriteFile(cut, bytes.substr(0, size));
    EXPECT_THAT(PhotoErrorOf(cut), testing::StartsWith(cut.string() + ": ")) << size;
  }
  WriteFile(cut, bytes);
  EXPECT_EQ(PhotoErrorOf(cut), "");
}

TEST(Photo, AJpegWithAHoleIsNamed) {
  TempFolder temp;
  std::string bytes = ReadFile(kPhoto);
  bytes.erase(bytes.size() / 2, 500);
  WriteFile(temp / "hole.jpg", bytes);
  EXPECT_THAT(PhotoErrorOf(temp / "hole.jpg"), HasSubstr("hole.jpg: cannot be decoded completely"));
}

TEST(Photo, EveryCutOfAPngIsNamed) {
  TempFolder temp;
  const fs::path path = temp / "p.png";
  std::vector<uint8_t> samples(3 * 16 * 16);
  for (size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<uint8_t>(i * i * 31);
  WritePng(path, 16, 16, 8, PNG_COLOR_TYPE_RGB, samples);
  EXPECT_EQ(ReadPhoto(path).data, samples);
  const std::string bytes = ReadFile(path);
  for (size_t size = 0; size < bytes.size(); ++size) {
    WriteFile(path, bytes.substr(0, size));
    ASSERT_NE(PhotoErrorOf(path), "") << size;
  }
  // One wrong bit anywhere but in the eight bytes that say what the file is.
  for (size_t i = 8; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 4);
    WriteFile(path, damaged);
    ASSERT_NE(PhotoErrorOf(path), "") << i;
  }
}

TEST(Photo, APngIsReadAsOneWhateverItsName) {
  TempFolder temp;
  const fs::path path = temp / "p.jpg";
  const std::vector<uint8_t> samples = {1, 2, 3, 250, 100, 0};
  WritePng(path, 2, 1, 8, PNG_COLOR_TYPE_RGB, samples);
  EXPECT_EQ(ReadPhoto(path).data, samples);
  WriteFile(path, ReadFile(path).substr(0, 20));
  EXPECT_THAT(UserErrorOf([&] { ReadPhotoSize(path); }),
              testing::AllOf(HasSubstr("p.jpg: is no readable image"),
                             testing::Not(HasSubstr("JPEG file"))));
}

TEST(Photo, GreyAlphaAndSixteenBitsBecomeDisplayValues) {
  TempFolder temp;
  const fs::path path = temp / "p.png";
  WritePng(path, 2, 1, 8, PNG_COLOR_TYPE_GRAY, {0, 200});
  EXPECT_THAT(ReadPhoto(path).data, ElementsAre(0, 0, 0, 200, 200, 200));
  WritePng(path, 2, 1, 8, PNG_COLOR_TYPE_GRAY_ALPHA, {100, 255, 100, 0});
  EXPECT_THAT(ReadPhoto(path).data, ElementsAre(100, 100, 100, 255, 255, 255));
  // Over white: 0.2 * (250, 100, 0) + 0.8 * 255.
  WritePng(path, 2, 1, 8, PNG_COLOR_TYPE_RGB_ALPHA, {250, 100, 0, 51, 1, 2, 3, 255});
  EXPECT_THAT(ReadPhoto(path).data, ElementsAre(254, 224, 204, 1, 2, 3));
  WritePng(path, 1, 1, 16, PNG_COLOR_TYPE_RGB, {255, 255, 128, 128, 0, 0});
  EXPECT_THAT(ReadPhoto(path).data, ElementsAre(255, 128, 0));
  // The palette of WritePng: index 1 is (37, 254, 200).
  WritePng(path, 2, 1, 8, PNG_COLOR_TYPE_PALETTE, {1, 0});
  EXPECT_THAT(ReadPhoto(path).data, ElementsAre(37, 254, 200, 0, 255, 200));
}

TEST(Photo, StoredPixelsStayWhateverExifSays) {
  TempFolder temp;
  WriteFile(temp / "turned.jpg", Turned(ReadFile(kPhoto)));
  const Image8 turned = ReadPhoto(temp / "turned.jpg");
  EXPECT_EQ(turned.width, 320);
  EXPECT_EQ(turned.data, ReadPhoto(kPhoto).data);
}

TEST(Photo, WhatIsNoPhotoIsNamed) {
  TempFolder temp;
  EXPECT_THAT(PhotoErrorOf(temp / "none.jpg"), HasSubstr("none.jpg: there is no such file"));
  WriteFile(temp / "text.jpg", "This is no photo.");
  EXPECT_THAT(PhotoErrorOf(temp / "text.jpg"), HasSubstr("text.jpg: is no readable image"));
  WriteFile(temp / "empty.jpg", "");
  EXPECT_THAT(PhotoErrorOf(temp / "empty.jpg"), HasSubstr("empty.jpg: is no readable image"));
  // A portable float map of one pixel.
  WriteFile(temp / "float.pfm", std::string("PF\n1 1\n-1.0\n") + std::string(12, '\0'));
  EXPECT_THAT(PhotoErrorOf(temp / "float.pfm"), HasSubstr("float.pfm: holds floating-point"));
  // A header that promises 2^31 pixels for 100 bytes.
  std::string huge = "BM";
  WritePng(temp / "huge.png", 1, 1, 8, PNG_COLOR_TYPE_GRAY, {0});
  huge = ReadFile(temp / "huge.png");
  std::memcpy(huge.data() + 16, "\x00\x00\xc0\x00\x00\x00\xc0\x00", 8);
  WriteFile(temp / "huge.png", huge);
  EXPECT_NE(PhotoErrorOf(temp / "huge.png"), "");
  EXPECT_NE(UserErrorOf([&] { ReadPhotoSize(temp / "huge.png"); }), "");
}

TEST(Photo, AspectsAgreeToAPixel) {
  EXPECT_TRUE(SameAspect({640, 480}, {320, 240}));
  EXPECT_TRUE(SameAspect({1333, 1000}, {4000, 3000}));
  EXPECT_TRUE(SameAspect({854, 480}, {1920, 1080}));
  EXPECT_FALSE(SameAspect({480, 640}, {640, 480}));
  EXPECT_FALSE(SameAspect({640, 480}, {640, 476}));
  EXPECT_TRUE(SameAspect({640, 480}, {640, 481}));
}

TEST(Photo, ReducedSizesKeepTheAspect) {
  EXPECT_EQ(ReducedSize({640, 480}, -1), (PhotoSize{640, 480}));
  EXPECT_EQ(ReducedSize({640, 480}, 640), (PhotoSize{640, 480}));
  EXPECT_EQ(ReducedSize({640, 480}, 320), (PhotoSize{320, 240}));
  EXPECT_EQ(ReducedSize({480, 640}, 100), (PhotoSize{75, 100}));
  EXPECT_EQ(ReducedSize({3000, 1}, 30), (PhotoSize{30, 1}));
}

TEST(Photo, ReducingIsTheMeanOfLinearLightOverTheArea) {
  // Black and white in equal shares are half the light: 188 of 255 in sRGB, not 128.
  const Image8 stripes{
      4, 2, std::vector<uint8_t>{0,   0,   0,   255, 255, 255, 0,   0,   0,   255, 255, 255,
                                 255, 255, 255, 0,   0,   0,   255, 255, 255, 0,   0,   0}};
  EXPECT_THAT(ReducePhoto(stripes, {2, 1}).data, testing::Each(188));
  EXPECT_EQ(ReducePhoto(stripes, {4, 2}).data, stripes.data);
  // 3 pixels become 2: the middle one belongs to both by halves, so a white one gives each a third
  // of the light.
  const Image8 line{3, 1, {0, 0, 0, 255, 255, 255, 0, 0, 0}};
  EXPECT_THAT(ReducePhoto(line, {2, 1}).data, testing::Each(156));
  // A flat photo stays what it is, at any size and value.
  for (int value = 0; value < 256; ++value) {
    const Image8 flat{7, 5, std::vector<uint8_t>(3 * 35, static_cast<uint8_t>(value))};
    EXPECT_THAT(ReducePhoto(flat, {3, 2}).data, testing::Each(value));
  }
}

}  // namespace
}  // namespace semfoam
