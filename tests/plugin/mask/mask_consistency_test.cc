// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_consistency.h"

#include "foam/util/random.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "tests/plugin/mask/wall.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::HasSubstr;

constexpr std::array<int, 3> kTruth = {7, 8, 9};

TEST(MaskConsistency, ConsistentMasksStayAsTheyAre) {
  Wall wall;
  const MaskConsistencyReport report = wall.Correct(MaskConsistency::kAuto);
  EXPECT_EQ(report.used, MaskConsistency::kTracks);
  EXPECT_EQ(report.num_regions, 36);
  EXPECT_EQ(report.num_renamed + report.num_split + report.num_dropped, 0);
  EXPECT_EQ(report.agreement_before, 1);
  EXPECT_EQ(report.agreement_after, 1);
  EXPECT_EQ(wall.masks.labels.size(), 3u);
  for (int view = 0; view < kViews; ++view) {
    for (int i = 0; i < kWidth * kHeight; ++i) {
      ASSERT_EQ(wall.IdAt(view, i % kWidth, i / kWidth), wall.ids[view][i]);
    }
  }
}

TEST(MaskConsistency, SwitchedAndNewIdsAreRenamed) {
  Wall wall;
  wall.PaintBand(3, 0, 8);  // two things trade their ids
  wall.PaintBand(3, 1, 7);
  wall.PaintBand(6, 2, 40);  // the tracker starts anew
  const MaskConsistencyReport report = wall.Correct(MaskConsistency::kTracks);
  EXPECT_EQ(report.num_renamed, 3);
  EXPECT_LT(report.agreement_before, 0.95);
  EXPECT_EQ(report.agreement_after, 1);
  EXPECT_EQ(wall.masks.labels.size(), 3u);  // 40 is gone
  for (int view = 0; view < kViews; ++view) EXPECT_EQ(wall.BandIds(view), kTruth) << view;
  EXPECT_THAT(report.Line(), HasSubstr("of 36 regions 3 renamed, 0 split, 0 dropped"));
  EXPECT_THAT(report.Line(), HasSubstr("4 ids became 3 labels"));
}

TEST(MaskConsistency, AnIdThatTakesOverHalfwayIsTheSameThing) {
  Wall wall;
  for (int view = 7; view < kViews; ++view) wall.PaintBand(view, 1, 50);
  wall.Correct(MaskConsistency::kTracks);
  EXPECT_EQ(wall.masks.labels.size(), 3u);
  for (int view = 0; view < kViews; ++view) EXPECT_EQ(wall.BandIds(view), kTruth) << view;
}

TEST(MaskConsistency, MergedRegionsAreSplitAtTheirPoints) {
  Wall wall;
  wall.PaintBand(5, 0, 8);
  const MaskConsistencyReport report = wall.Correct(MaskConsistency::kTracks);
  EXPECT_EQ(report.num_split, 1);
  EXPECT_EQ(wall.BandIds(5), kTruth);
  // Wrong pixels are few, and those of neither side are between the two.
  int wrong = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < 2 * kBand; ++x) {
      const int id = wall.IdAt(5, x, y);
      wrong += id != -1 && id != kTruth[x / kBand];
      EXPECT_TRUE(id != -1 || std::abs(x - kBand) < kBand / 2) << x << " " << y;
    }
  }
  EXPECT_LT(wrong, 0.02 * 2 * kBand * kHeight);
}

TEST(MaskConsistency, FragmentsGoToWhatTheyAreFragmentsOf) {
  Wall wall;
  wall.Paint(2, 30, 0, 30, [](int) { return 60; });
  // Too small for a point to say what it is.
  wall.Paint(4, kHeight - 3, 100, 103, [](int) { return 61; });
  const MaskConsistencyReport report = wall.Correct(MaskConsistency::kTracks);
  EXPECT_EQ(report.num_renamed, 1);
  EXPECT_EQ(report.num_dropped, 1);
  EXPECT_EQ(wall.IdAt(2, 15, 45), 7);
  EXPECT_EQ(wall.IdAt(4, 101, kHeight - 1), -1);
  EXPECT_EQ(wall.IdAt(4, 110, kHeight - 1), 9);
  EXPECT_EQ(wall.masks.labels.size(), 3u);
}

TEST(MaskConsistency, FewMasksThatAgreeAreBelieved) {
  Wall wall;
  for (int view = 8; view < kViews; ++view) wall.Paint(view, 0, 0, kWidth, [](int) { return 0; });
  MaskConsistencyReport report = wall.Correct(MaskConsistency::kAuto);
  EXPECT_EQ(report.used, MaskConsistency::kOff);
  EXPECT_EQ(report.Line(), "The few masks agree with the tracks; they are believed");
  // Two of eight contradict the others.
  wall.PaintBand(5, 0, 8);
  wall.PaintBand(3, 2, 7);
  report = wall.Correct(MaskConsistency::kAuto);
  EXPECT_EQ(report.used, MaskConsistency::kTracks);
  // Twelve are held against the tracks however well they agree.
  EXPECT_EQ(Wall().Correct(MaskConsistency::kAuto).used, MaskConsistency::kTracks);
}

// Where few photos have masks, a small thing is in one of them, and no point need confirm it.
TEST(MaskConsistency, FewMasksHaveNoFragments) {
  Wall wall;
  for (int view = 8; view < kViews; ++view) wall.Paint(view, 0, 0, kWidth, [](int) { return 0; });
  wall.Paint(4, kHeight - 3, 100, 103, [](int) { return 61; });
  const MaskConsistencyReport report = wall.Correct(MaskConsistency::kTracks);
  EXPECT_EQ(report.num_dropped, 0);
  EXPECT_EQ(wall.IdAt(4, 101, kHeight - 1), 61);
  EXPECT_EQ(wall.masks.labels.size(), 4u);
}

// A thing without texture has no points; what many photos say of it is believed.
TEST(MaskConsistency, RegionsWithoutPointsAreBelieved) {
  Wall wall;
  for (int view = 0; view < kViews; ++view) {
    wall.Paint(view, kHeight - 4, 60, 64, [](int) { return 70; });
  }
  const MaskConsistencyReport report = wall.Correct(MaskConsistency::kTracks);
  EXPECT_EQ(report.num_unjudged, kViews);
  EXPECT_EQ(report.num_dropped, 0);
  EXPECT_EQ(wall.IdAt(8, 61, kHeight - 1), 70);
}

TEST(MaskConsistency, IndependentMasksAreMatched) {
  // Each photo numbers in an order of its own.
  Wall wall;
  for (int view = 0; view < kViews; ++view) {
    CounterRandom random(3, 4, view);
    std::array<int, 3> order = {1, 2, 3};
    for (int i = 2; i > 0; --i) std::swap(order[i], order[random.Below(i + 1)]);
    for (int band = 0; band < 3; ++band) wall.PaintBand(view, band, order[band]);
  }
  wall.Paint(9, 30, 0, 30, [](int) { return 4; });  // in two parts here
  wall.photos[1].held_out = true;
  for (PixelObservations& track : wall.tracks) {
    std::erase_if(track, [](const PixelObservation& observation) { return observation.view == 1; });
  }
  const MaskConsistencyReport report = wall.Correct(MaskConsistency::kAuto);
  EXPECT_EQ(report.used, MaskConsistency::kIndependent);
  EXPECT_LT(report.agreement_before, 0.1);
  EXPECT_EQ(report.agreement_after, 1);
  ASSERT_EQ(wall.masks.labels.size(), 3u);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(wall.masks.labels[k].id, LabelId{k + 1});
    EXPECT_EQ(Value(wall.masks.labels[k].source_id), k + 1u);
  }
  const std::array<int, 3> labels = wall.BandIds(0);
  EXPECT_THAT(labels, testing::UnorderedElementsAre(1, 2, 3));
  for (int view = 2; view < kViews; ++view) EXPECT_EQ(wall.BandIds(view), labels) << view;
  EXPECT_EQ(wall.IdAt(9, 15, 45), labels[0]);
  EXPECT_EQ(wall.BandIds(1), (std::array<int, 3>{-1, -1, -1}));
}

// Of a thing that is nearly everywhere the photos agree nine times in ten, which is no more than
// chance would have it; its ids mean what they say all the same.
TEST(MaskConsistency, OneThingNearlyEverywhereIsNoIndependentMask) {
  Wall wall;
  for (int view = 0; view < kViews; ++view) {
    for (int band = 0; band < 3; ++band) wall.PaintBand(view, band, 7);
  }
  wall.PaintBand(3, 2, 9);
  wall.PaintBand(8, 0, 9);
  const MaskConsistencyReport report = wall.Correct(MaskConsistency::kAuto);
  EXPECT_LT(report.agreement_before, 0.1);
  EXPECT_EQ(report.used, MaskConsistency::kTracks);
  for (int view = 0; view < kViews; ++view) EXPECT_EQ(wall.IdAt(view, 60, 30), 7);
  EXPECT_EQ(wall.IdAt(3, 100, 30), 7);
  EXPECT_EQ(wall.IdAt(8, 20, 30), 7);
}

TEST(MaskConsistency, TheBackgroundKeepsItsIdInIndependentMasks) {
  Wall wall;
  for (int view = 0; view < kViews; ++view) {
    wall.PaintBand(view, 0, 1 + view % 2);
    wall.PaintBand(view, 1, 0);
    wall.PaintBand(view, 2, 2 - view % 2);
  }
  wall.Correct(MaskConsistency::kIndependent, /*zero_is_class=*/true);
  ASSERT_EQ(wall.masks.labels.size(), 3u);
  for (int view = 0; view < kViews; ++view) {
    EXPECT_EQ(wall.BandIds(view), (std::array<int, 3>{1, 0, 2})) << view;
  }
}

TEST(MaskConsistency, HeldOutPhotosHaveNoSay) {
  Wall wall;
  Wall other;
  for (Wall* w : {&wall, &other}) {
    w->photos[4].held_out = true;
    w->PaintBand(3, 0, 8);
    w->PaintBand(3, 1, 7);
  }
  // Even their observations, if there were any, and whatever their mask is.
  for (int band = 0; band < 3; ++band) other.PaintBand(4, band, 90 + band);
  wall.Correct(MaskConsistency::kTracks);
  other.Correct(MaskConsistency::kTracks);
  for (int view = 0; view < kViews; ++view) {
    if (view == 4) continue;
    EXPECT_EQ(wall.BandIds(view), kTruth);
    EXPECT_EQ(other.BandIds(view), kTruth);
  }
  EXPECT_EQ(wall.BandIds(4), kTruth);
  EXPECT_EQ(other.BandIds(4), (std::array<int, 3>{-1, -1, -1}));
  EXPECT_EQ(other.masks.labels.size(), 3u);
}

TEST(MaskConsistency, WithoutEvidenceMasksAreBelieved) {
  Wall wall(/*num_points=*/4);
  wall.PaintBand(3, 0, 8);
  for (const MaskConsistency mode : {MaskConsistency::kAuto, MaskConsistency::kOff}) {
    const MaskConsistencyReport report = wall.Correct(mode);
    EXPECT_EQ(report.used, MaskConsistency::kOff);
    EXPECT_EQ(wall.IdAt(3, 20, 30), 8);
  }
  Wall empty(/*num_points=*/0);
  EXPECT_EQ(empty.Correct(MaskConsistency::kTracks).used, MaskConsistency::kOff);
}

// Points near a border, where masks are ragged, and outside of their photo say nothing.
TEST(MaskConsistency, ObservationsAtBordersSayNothing) {
  Wall wall(/*num_points=*/0);
  for (int i = 0; i < 200; ++i) {
    const float y = 2 + 0.25f * static_cast<float>(i);
    wall.seeds.push_back({{0.3f, y / kWidth, 0}, Eigen::Vector3f::Zero()});
    wall.tracks.push_back(
        {{0, {kBand - 0.5f, y}}, {1, {kBand + 0.5f, y}}, {2, {-3, y}}, {3, {500, y}}});
  }
  EXPECT_EQ(wall.Correct(MaskConsistency::kTracks).used, MaskConsistency::kOff);
}

}  // namespace
}  // namespace semfoam
