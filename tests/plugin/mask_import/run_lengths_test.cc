// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_import/run_lengths.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::ElementsAre;

PixelRuns RandomRegion(const PhotoSize& size, uint64_t seed, uint32_t share) {
  PixelRuns runs;
  const int64_t pixels = static_cast<int64_t>(size.width) * size.height;
  uint64_t state = seed;
  for (int64_t i = 0; i < pixels; ++i) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    if ((state >> 33) % 100 < share) AppendRun({i, i + 1}, &runs);
  }
  return runs;
}

// Examples of pycocotools: encode(np.asfortranarray(mask))["counts"].
TEST(RunLengths, AreThoseOfCoco) {
  // 3 x 3, the pixel in the middle.
  const PhotoSize three = {3, 3};
  EXPECT_THAT(LengthsOfRuns({{4, 5}}, three), ElementsAre(4, 1, 4));
  EXPECT_EQ(EncodeRunLengths({4, 1, 4}), "414");
  // All of them: an empty first run.
  EXPECT_THAT(LengthsOfRuns({{0, 9}}, three), ElementsAre(0, 9));
  EXPECT_EQ(EncodeRunLengths({0, 9}), "09");
  EXPECT_THAT(LengthsOfRuns({}, three), ElementsAre(9));
  // From the fourth on, differences; more than four bits, and negative ones.
  EXPECT_EQ(EncodeRunLengths({100, 20, 100, 3}), "T3d0T3_O");
  EXPECT_THAT(DecodeRunLengths("T3d0T3_O").lengths, ElementsAre(100, 20, 100, 3));
}

TEST(RunLengths, ColumnsBecomeRows) {
  // The first column of 2 x 3 pixels, and the first pixel of the second.
  const auto runs = RunsOfLengths({0, 4, 2}, {2, 3});
  ASSERT_TRUE(runs);
  EXPECT_THAT(*runs, ElementsAre(PixelRun{0, 3}, PixelRun{4, 5}));
}

TEST(RunLengths, ComeBack) {
  int cases = 0;
  for (const PhotoSize size : {PhotoSize{1, 1}, {7, 1}, {1, 9}, {23, 17}, {640, 480}}) {
    for (const uint32_t share : {0, 1, 30, 99, 100}) {
      const PixelRuns runs = RandomRegion(size, ++cases, share);
      const std::vector<int64_t> lengths = LengthsOfRuns(runs, size);
      EXPECT_EQ(RunsOfLengths(lengths, size), runs);
      EXPECT_EQ(DecodeRunLengths(EncodeRunLengths(lengths)).lengths, lengths);
    }
  }
}

TEST(RunLengths, DamagedOnesAreRefused) {
  const struct {
    std::string text;
    const char* error;
  } cases[] = {{"4 4", "character 2 is none of a compressed run"},
               {"4\x80", "character 2 is none of a compressed run"},
               {"4p", "character 2 is none of a compressed run"},
               {"4X", "run 2 is cut"},
               {"X", "run 1 is cut"},
               {"O", "run 1 is negative"},
               {"111O1O", "run 6 is negative"},
               {"oooooooooo", "run 1 has more than 9 characters"},
               {"oooooooo?", "run 1 is longer than any picture"}};
  for (const auto& [text, error] : cases) {
    const RunLengths decoded = DecodeRunLengths(text);
    EXPECT_EQ(decoded.error, error) << text;
    EXPECT_TRUE(decoded.lengths.empty());
  }
  const PhotoSize size = {3, 3};
  for (const std::vector<int64_t>& lengths : std::vector<std::vector<int64_t>>{
           {}, {4, 1, 3}, {4, 1, 5}, {4, -1, 6}, {10}, {INT64_MAX, INT64_MAX, 11}}) {
    EXPECT_FALSE(RunsOfLengths(lengths, size));
  }
}

TEST(Polygons, CoverPixelsWhoseCentresTheyHold) {
  const PhotoSize size = {6, 5};
  EXPECT_THAT(FillPolygons({{{1, 1}, {3, 1}, {3, 3}, {1, 3}}}, size),
              ElementsAre(PixelRun{7, 9}, PixelRun{13, 15}));
  // Half a pixel to the right and down is still there, a bit more is not.
  EXPECT_THAT(FillPolygons({{{1.5, 1.5}, {3, 1.5}, {3, 3}, {1.5, 3}}}, size),
              ElementsAre(PixelRun{7, 9}, PixelRun{13, 15}));
  EXPECT_THAT(FillPolygons({{{1.51, 1.51}, {3, 1.51}, {3, 3}, {1.51, 3}}}, size),
              ElementsAre(PixelRun{14, 15}));
  // Beyond the picture, in all directions.
  EXPECT_THAT(FillPolygons({{{-1e9, -1e9}, {1e9, -1e9}, {1e9, 1e9}, {-1e9, 1e9}}}, size),
              ElementsAre(PixelRun{0, 30}));
  EXPECT_TRUE(FillPolygons({{{7, 1}, {9, 1}, {9, 3}}}, size).empty());
  // A triangle: row by row.
  EXPECT_THAT(FillPolygons({{{0, 0}, {5, 5}, {0, 5}}}, size),
              ElementsAre(PixelRun{6, 7}, PixelRun{12, 14}, PixelRun{18, 21}, PixelRun{24, 28}));
  // Overlapping ones count once.
  EXPECT_THAT(
      FillPolygons({{{0, 0}, {3, 0}, {3, 1}, {0, 1}}, {{2, 0}, {4, 0}, {4, 1}, {2, 1}}}, size),
      ElementsAre(PixelRun{0, 4}));
  // A polygon with a hole: there and back along one line.
  const Polygon ring = {
      {0, 0}, {5, 0}, {5, 5}, {0, 5}, {0, 0}, {2, 2}, {3, 2}, {3, 3}, {2, 3}, {2, 2}};
  EXPECT_EQ(AreaOf(FillPolygons({ring}, size)), 24);
}

}  // namespace
}  // namespace semfoam
