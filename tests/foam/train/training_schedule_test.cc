// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/training_schedule.h"

#include "tests/foam/synthetic_views.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int64_t kMillion = 1'000'000;

// 16 held-out photos of 640x480 and 48 others, 15 million pixels.
const SyntheticViews kViews(64, 640, 480);

TEST(TrainingSchedule, ShortRunsLookAtFewPixels) {
  for (const int64_t rays : {20 * kMillion, 140 * kMillion}) {
    EXPECT_LE(EvaluationRays(kViews, rays), rays / 20);
    EXPECT_LE(StatisticsRays(kViews, rays), rays / 8);
  }
  EXPECT_GT(EvaluationStride(kViews, 20 * kMillion), 4);
  EXPECT_GT(StatisticsStride(kViews, 20 * kMillion), 2);
}

TEST(TrainingSchedule, LongRunsLookAtEveryFourthAndSecondPixel) {
  EXPECT_EQ(EvaluationStride(kViews, 400 * kMillion), 4);
  EXPECT_EQ(StatisticsStride(kViews, 400 * kMillion), 2);
  EXPECT_EQ(EvaluationRays(kViews, 400 * kMillion), 20 * 16 * 160 * 120);
  EXPECT_EQ(StatisticsRays(kViews, 400 * kMillion), 48 * 320 * 240);
}

TEST(TrainingSchedule, ScoresOfAFewRaysStillMeanSomething) {
  EXPECT_GT(EvaluationRays(kViews, 1000), 20 * 10'000);
  EXPECT_GT(StatisticsRays(kViews, 1000), 200'000);
}

}  // namespace
}  // namespace semfoam
