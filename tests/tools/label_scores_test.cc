// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/label_scores.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::ElementsAre;

LabelImage Row(std::vector<int32_t> ids) {
  const int width = static_cast<int>(ids.size());
  return {width, 1, std::move(ids)};
}

TEST(LabelScores, PerfectRendersScoreOne) {
  const LabelImage rendered = Row({0, 7, 7, 3});
  const auto score = ScoreObject({{&rendered, Row({0, 1, 1, 0})}}, 7);
  ASSERT_TRUE(score.has_value());
  EXPECT_EQ(score->direct->iou, 1);
  EXPECT_EQ(score->direct->recall, 1);
  EXPECT_EQ(score->prompt.iou, 1);
  EXPECT_THAT(score->prompt_labels, ElementsAre(7));
}

TEST(LabelScores, UnionCountsWhatIsTooMuchAndRecallDoesNot) {
  const LabelImage rendered = Row({7, 7, 7, 7});
  const auto score = ScoreObject({{&rendered, Row({1, 0, 0, 0})}}, 7);
  EXPECT_DOUBLE_EQ(score->direct->iou, 0.25);
  EXPECT_DOUBLE_EQ(score->direct->recall, 1);
}

TEST(LabelScores, APromptGathersAllLabelsThatLieMostlyInside) {
  // Labels 4 and 5 lie inside, 6 by exactly half: not more than half, so it is none of the object.
  const LabelImage first = Row({4, 4, 5, 6, 6, 9});
  const LabelImage second = Row({4, 5, 9, 9, 9, 9});
  const auto score = ScoreObject(
      {{&first, Row({1, 1, 1, 1, 0, 0})}, {&second, Row({1, 1, 1, 1, 0, 0})}}, std::nullopt);
  EXPECT_THAT(score->prompt_labels, ElementsAre(4, 5));
  EXPECT_DOUBLE_EQ(score->prompt.iou, (3.0 / 4 + 2.0 / 4) / 2);
  EXPECT_FALSE(score->direct.has_value());
}

TEST(LabelScores, APromptWithoutAMajorityTakesTheMostFrequent) {
  const LabelImage rendered = Row({2, 2, 1, 2, 2, 2, 1});
  const auto score = ScoreObject({{&rendered, Row({1, 1, 1, 0, 0, 0, 0})}}, 1);
  EXPECT_THAT(score->prompt_labels, ElementsAre(2));
  EXPECT_DOUBLE_EQ(score->prompt.iou, 2.0 / 6);
  EXPECT_DOUBLE_EQ(score->direct->iou, 1.0 / 4);
}

TEST(LabelScores, ViewsWithoutTheObjectAreNoneOfItsViews) {
  const LabelImage rendered = Row({7, 0});
  const LabelImage other = Row({7, 7});
  const auto score =
      ScoreObject({{&other, Row({0, 0})}, {&rendered, Row({255, 0})}, {&other, Row({0, 0})}}, 7);
  EXPECT_EQ(score->num_views, 1);
  EXPECT_EQ(score->direct->iou, 1);
  EXPECT_FALSE(ScoreObject({{&other, Row({0, 0})}}, 7).has_value());
  EXPECT_FALSE(ScoreObject({}, 7).has_value());
}

}  // namespace
}  // namespace semfoam
