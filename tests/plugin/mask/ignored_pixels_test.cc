// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/ignored_pixels.h"

#include <algorithm>

#include "tests/mistake.h"
#include "tests/plugin/mask/grey_mask.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// The pixels as text, '#' where ignored.
std::string TextOf(const IgnoredPixels& pixels, int width, int height) {
  std::string text;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) text += pixels.Contains(x, y) ? '#' : '.';
    text += '\n';
  }
  EXPECT_EQ(pixels.NumPixels(), std::count(text.begin(), text.end(), '#'));
  return text;
}

TEST(IgnoredPixels, BlackIsIgnored) {
  const TempFolder temp;
  WriteGrey(temp / "a.png", {0, 255, 1, 0, 0, 0, 9, 9});
  EXPECT_EQ(TextOf(ReadIgnoredPixels(temp / "a.png", {4, 2}, false), 4, 2), "#..#\n##..\n");
  EXPECT_EQ(TextOf(ReadIgnoredPixels(temp / "a.png", {4, 2}, true), 4, 2), ".##.\n..##\n");
}

TEST(IgnoredPixels, AreReadAtTheSizeOfThePhoto) {
  const TempFolder temp;
  WriteGrey(temp / "a.png", {0, 255, 1, 0, 0, 0, 9, 9});
  EXPECT_EQ(TextOf(ReadIgnoredPixels(temp / "a.png", {8, 4}, false), 8, 4),
            "##....##\n##....##\n####....\n####....\n");
  // The pixels at nearest centres: column 1 and 3, row 1.
  EXPECT_EQ(TextOf(ReadIgnoredPixels(temp / "a.png", {2, 1}, false), 2, 1), "#.\n");
}

TEST(IgnoredPixels, AlphaCountsWhereThereIsOne) {
  const TempFolder temp;
  WritePng(temp / "ga.png", 2, 1, 8, PNG_COLOR_TYPE_GRAY_ALPHA, {0, 255, 255, 0});
  EXPECT_EQ(TextOf(ReadIgnoredPixels(temp / "ga.png", {2, 1}, false), 2, 1), ".#\n");
  WritePng(temp / "rgba.png", 2, 1, 8, PNG_COLOR_TYPE_RGBA, {0, 0, 0, 9, 255, 255, 255, 0});
  EXPECT_EQ(TextOf(ReadIgnoredPixels(temp / "rgba.png", {2, 1}, false), 2, 1), ".#\n");
  WritePng(temp / "ga16.png", 2, 1, 16, PNG_COLOR_TYPE_GRAY_ALPHA, {0, 0, 0, 1, 9, 9, 0, 0});
  EXPECT_EQ(TextOf(ReadIgnoredPixels(temp / "ga16.png", {2, 1}, false), 2, 1), ".#\n");
  WritePng(temp / "rgb.png", 2, 1, 8, PNG_COLOR_TYPE_RGB, {0, 0, 7, 0, 0, 0});
  EXPECT_EQ(TextOf(ReadIgnoredPixels(temp / "rgb.png", {2, 1}, false), 2, 1), ".#\n");
}

TEST(IgnoredPixels, NoneAndAll) {
  const TempFolder temp;
  WriteGrey(temp / "white.png", std::vector<uint8_t>(8, 255));
  EXPECT_EQ(ReadIgnoredPixels(temp / "white.png", {4, 2}, false).NumPixels(), 0);
  EXPECT_EQ(ReadIgnoredPixels(temp / "white.png", {4, 2}, true).NumPixels(), 8);
  EXPECT_FALSE(IgnoredPixels().Contains(0, 0));
  EXPECT_EQ(IgnoredPixels().NumPixels(), 0);
}

TEST(IgnoredPixels, BadOnesAreRefused) {
  const TempFolder temp;
  WriteGrey(temp / "a.png", std::vector<uint8_t>(8, 255));
  const auto read = [&](const char* name, PhotoSize size) {
    return UserErrorOf([&] { ReadIgnoredPixels(temp / name, size, false); });
  };
  EXPECT_THAT(read("a.png", {4, 4}), NamesMistake("a.png", {"4 x 2", "4 x 4"}, "aspect"));
  EXPECT_THAT(read("b.png", {4, 2}), NamesMistake("b.png", {}, "no such file"));
  WriteFile(temp / "c.png", "no picture");
  EXPECT_THAT(read("c.png", {4, 2}), NamesMistake("c.png", {}, "no PNG file"));
  WriteFile(temp / "d.png", ReadFile(temp / "a.png").substr(0, 50));
  EXPECT_THAT(read("d.png", {4, 2}), NamesMistake("d.png", {}, "ends within a chunk"));
}

}  // namespace
}  // namespace semfoam
