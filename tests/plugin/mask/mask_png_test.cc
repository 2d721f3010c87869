// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_png.h"

#include <string>
#include <vector>

#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(MaskPng, ReadsEveryGreyDepthUnstretched) {
  TempFolder temp;
  const fs::path path = temp / "m.png";
  for (const bool interlaced : {false, true}) {
    WritePng(path, 5, 1, 1, PNG_COLOR_TYPE_GRAY, {0b10110000}, interlaced);
    EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(1, 0, 1, 1, 0));
    WritePng(path, 5, 1, 2, PNG_COLOR_TYPE_GRAY, {0b00011011, 0b11000000}, interlaced);
    EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(0, 1, 2, 3, 3));
    WritePng(path, 3, 2, 4, PNG_COLOR_TYPE_GRAY, {0x12, 0xf0, 0x34, 0x50}, interlaced);
    EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(1, 2, 15, 3, 4, 5));
    WritePng(path, 3, 1, 8, PNG_COLOR_TYPE_GRAY, {0, 7, 255}, interlaced);
    EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(0, 7, 255));
    WritePng(path, 2, 1, 16, PNG_COLOR_TYPE_GRAY, {0x01, 0x02, 0xff, 0xfe}, interlaced);
    EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(0x0102, 0xfffe));
    WritePng(path, 2, 1, 8, PNG_COLOR_TYPE_GRAY_ALPHA, {9, 0, 8, 255}, interlaced);
    EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(9, 8));
  }
}

TEST(MaskPng, ReadsPaletteIndicesNotColours) {
  TempFolder temp;
  const fs::path path = temp / "m.png";
  WritePng(path, 3, 1, 8, PNG_COLOR_TYPE_PALETTE, {0, 3, 250});
  EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(0, 3, 250));
  EXPECT_FALSE(ReadMaskPng(path).is_rgb);
  WritePng(path, 3, 1, 4, PNG_COLOR_TYPE_PALETTE, {0x1f, 0x20});
  EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(1, 15, 2));
  WritePng(path, 4, 1, 2, PNG_COLOR_TYPE_PALETTE, {0b00011011});
  EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(0, 1, 2, 3));
  WritePng(path, 4, 1, 1, PNG_COLOR_TYPE_PALETTE, {0b01100000});
  EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(0, 1, 1, 0));
}

TEST(MaskPng, ReadsLongIds) {
  TempFolder temp;
  const fs::path path = temp / "m.png";
  WritePng(path, 2, 1, 8, PNG_COLOR_TYPE_RGB, {1, 2, 3, 255, 255, 255});
  EXPECT_TRUE(ReadMaskPng(path).is_rgb);
  EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(1 + 256 * 2 + 65536 * 3, 0xffffff));
  WritePng(path, 2, 1, 8, PNG_COLOR_TYPE_RGB_ALPHA, {1, 2, 3, 0, 0, 0, 0, 255});
  EXPECT_THAT(ReadMaskPng(path).values, ElementsAre(1 + 256 * 2 + 65536 * 3, 0));
  WritePng(path, 1, 1, 16, PNG_COLOR_TYPE_RGB, {0, 1, 0, 2, 0, 3});
  EXPECT_THAT(UserErrorOf([&] { ReadMaskPng(path); }), HasSubstr("holds 16-bit colours"));
}

TEST(MaskPng, DamageIsNamed) {
  TempFolder temp;
  const fs::path path = temp / "m.png";
  std::vector<uint8_t> ids(32 * 32);
  for (size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<uint8_t>(i * i);
  WritePng(path, 32, 32, 8, PNG_COLOR_TYPE_GRAY, ids);
  const std::string bytes = ReadFile(path);
  for (size_t size = 0; size < bytes.size(); ++size) {
    WriteFile(path, bytes.substr(0, size));
    ASSERT_THAT(UserErrorOf([&] { ReadMaskPng(path); }), testing::StartsWith(path.string() + ": "))
        << size;
  }
  for (size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
    WriteFile(path, damaged);
    ASSERT_NE(UserErrorOf([&] { ReadMaskPng(path); }), "") << i;
  }
  WriteFile(path, "\xff\xd8\xff\xe0 a JPEG by another name");
  EXPECT_THAT(UserErrorOf([&] { ReadMaskPng(path); }), HasSubstr("is no PNG file"));
  EXPECT_THAT(UserErrorOf([&] { ReadMaskPng(temp / "none.png"); }),
              HasSubstr("there is no such file"));
  EXPECT_THAT(UserErrorOf([&] { ReadMaskPng(temp.path()); }), HasSubstr("is a folder"));
}

// A PNG whose header is valid, checksum included, and promises far more than its bytes hold.
TEST(MaskPng, ImplausibleSizesTakeNoMemory) {
  TempFolder temp;
  const fs::path path = temp / "m.png";
  FILE* file = std::fopen(path.c_str(), "wb");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_set_IHDR(png, info, 1'000'000, 1'000'000, 16, PNG_COLOR_TYPE_GRAY, 0, 0, 0);
  png_write_info(png, info);
  png_destroy_write_struct(&png, &info);
  const unsigned char kEnd[] = {0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xae, 0x42, 0x60, 0x82};
  std::fwrite(kEnd, 1, sizeof(kEnd), file);
  std::fclose(file);
  EXPECT_NE(UserErrorOf([&] { ReadMaskPng(path); }), "");
}

}  // namespace
}  // namespace semfoam
