// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/label_scores.h"

#include <algorithm>
#include <optional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::ElementsAre;

struct MaskedView {
  const LabelImage* rendered;
  LabelImage mask;
};

std::optional<ObjectScore> ScoreObject(const std::vector<MaskedView>& views,
                                       const std::optional<LabelId>& id) {
  ObjectScorer scorer(id);
  for (const MaskedView& view : views) scorer.Add(*view.rendered, view.mask);
  return scorer.Finish();
}

LabelImage Row(std::vector<int32_t> ids) {
  const int width = static_cast<int>(ids.size());
  return {width, 1, std::move(ids)};
}

TEST(LabelScores, PerfectRendersScoreOne) {
  const LabelImage rendered = Row({0, 7, 7, 3});
  const auto score = ScoreObject({{&rendered, Row({0, 1, 1, 0})}}, LabelId{7});
  ASSERT_TRUE(score.has_value());
  EXPECT_EQ(score->direct->iou, 1);
  EXPECT_EQ(score->direct->recall, 1);
  EXPECT_EQ(score->prompt.iou, 1);
  EXPECT_THAT(score->prompt_labels, ElementsAre(LabelId{7}));
}

TEST(LabelScores, UnionCountsWhatIsTooMuchAndRecallDoesNot) {
  const LabelImage rendered = Row({7, 7, 7, 7});
  const auto score = ScoreObject({{&rendered, Row({1, 0, 0, 0})}}, LabelId{7});
  EXPECT_DOUBLE_EQ(score->direct->iou, 0.25);
  EXPECT_DOUBLE_EQ(score->direct->recall, 1);
}

TEST(LabelScores, APromptGathersAllLabelsThatLieMostlyInside) {
  // Labels 4 and 5 lie inside, 6 by exactly half: not more than half, so it is none of the object.
  const LabelImage first = Row({4, 4, 5, 6, 6, 9});
  const LabelImage second = Row({4, 5, 9, 9, 9, 9});
  const auto score = ScoreObject(
      {{&first, Row({1, 1, 1, 1, 0, 0})}, {&second, Row({1, 1, 1, 1, 0, 0})}}, std::nullopt);
  EXPECT_THAT(score->prompt_labels, ElementsAre(LabelId{4}, LabelId{5}));
  EXPECT_DOUBLE_EQ(score->prompt.iou, (3.0 / 4 + 2.0 / 4) / 2);
  EXPECT_FALSE(score->direct.has_value());
}

TEST(LabelScores, APromptWithoutAMajorityTakesTheMostFrequent) {
  const LabelImage rendered = Row({2, 2, 1, 2, 2, 2, 1});
  const auto score = ScoreObject({{&rendered, Row({1, 1, 1, 0, 0, 0, 0})}}, LabelId{1});
  EXPECT_THAT(score->prompt_labels, ElementsAre(LabelId{2}));
  EXPECT_DOUBLE_EQ(score->prompt.iou, 2.0 / 6);
  EXPECT_DOUBLE_EQ(score->direct->iou, 1.0 / 4);
}

TEST(LabelScores, ViewsWithoutTheObjectAreNoneOfItsViews) {
  const LabelImage rendered = Row({7, 0});
  const LabelImage other = Row({7, 7});
  const auto score = ScoreObject(
      {{&other, Row({0, 0})}, {&rendered, Row({255, 0})}, {&other, Row({0, 0})}}, LabelId{7});
  ASSERT_EQ(score->views.size(), 1);
  EXPECT_EQ(score->views[0].view, 1);
  EXPECT_EQ(score->direct->iou, 1);
  EXPECT_FALSE(ScoreObject({{&other, Row({0, 0})}}, LabelId{7}).has_value());
  EXPECT_FALSE(ScoreObject({}, LabelId{7}).has_value());
}

// A square of `size` pixels at (left, top) in an image of 100x75, whose boundary is 3 pixels wide
// (2 % of its diagonal of 125, rounded).
LabelImage Square(int left, int top, int size) {
  LabelImage image{100, 75, std::vector<int32_t>(100 * 75, 0)};
  for (int y = top; y < top + size; ++y) {
    for (int x = left; x < left + size; ++x) image.data[100 * y + x] = 1;
  }
  return image;
}

int64_t CountOnes(const LabelImage& image) {
  return std::count(image.data.begin(), image.data.end(), 1);
}

TEST(LabelScores, ABoundaryIsAsWideAsTheImageSays) {
  EXPECT_EQ(CountOnes(BoundaryOf(Square(20, 20, 30))), 30 * 30 - 24 * 24);
  // What is thinner than twice the width is boundary all through.
  EXPECT_EQ(CountOnes(BoundaryOf(Square(20, 20, 6))), 36);
  EXPECT_EQ(CountOnes(BoundaryOf(Square(20, 20, 7))), 49 - 1);
  // The image's own border is one of the object: beyond it is outside.
  EXPECT_EQ(CountOnes(BoundaryOf(Square(0, 0, 30))), 30 * 30 - 24 * 24);
  EXPECT_EQ(CountOnes(BoundaryOf({1, 1, {1}})), 1);
}

TEST(LabelScores, BoundariesSeeAShiftThatAreasHide) {
  const LabelImage shown = Square(21, 20, 50);
  const auto score = ScoreObject({{&shown, Square(20, 20, 50)}}, LabelId{1});
  EXPECT_DOUBLE_EQ(score->direct->iou, 49.0 / 51);
  // Of two frames, 3 wide and 50 high, a pixel apart: along top and bottom (3 rows, 49 of 51
  // columns) and along the sides (44 rows, 2 of 4 columns, twice) they meet.
  const double both = 2 * 3 * 49 + 2 * 44 * 2;
  const double frame = 50 * 50 - 44 * 44;
  EXPECT_DOUBLE_EQ(score->direct->boundary_iou, both / (2 * frame - both));
  EXPECT_EQ(score->prompt.boundary_iou, score->direct->boundary_iou);
}

}  // namespace
}  // namespace semfoam
