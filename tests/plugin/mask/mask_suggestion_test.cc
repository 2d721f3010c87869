// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_suggestion.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// A row of points a voxel apart, those of [begin, end) observed by these views.
void AddRow(int begin, int end, const std::vector<int32_t>& views, std::vector<ObservedPoint>* to) {
  for (int i = begin; i < end; ++i) to->push_back({Eigen::Vector3d(i + 0.5, 0.5, 0.5), views});
}

// Views 0 and 1 see the first half of a wall, 2 the second half, 3 a bit in the middle.
std::vector<ObservedPoint> Wall() {
  std::vector<ObservedPoint> points;
  AddRow(0, 8, {0, 1}, &points);
  AddRow(8, 10, {0, 1, 3}, &points);
  AddRow(10, 12, {2, 3}, &points);
  AddRow(12, 21, {2}, &points);
  return points;
}

std::vector<int32_t> ViewsOf(const MaskSuggestion& suggestion) {
  std::vector<int32_t> views;
  for (const MaskSuggestion::Photo& photo : suggestion.photos) views.push_back(photo.view);
  return views;
}

const std::vector<bool> kNone(4, false), kAll(4, true);

TEST(MaskSuggestion, TakesThePhotosThatTogetherShowAll) {
  const MaskSuggestion suggestion = SuggestPhotosToMask(Wall(), kNone, kAll, 3);
  EXPECT_EQ(suggestion.shown, 0);
  // View 2 shows eleven of the 21 voxels, and in part the next three. View 0 shows the others, and
  // views 1 and 3 add nothing.
  EXPECT_THAT(ViewsOf(suggestion), ElementsAre(2, 0));
  EXPECT_NEAR(suggestion.photos[0].shown, 12.5 / 21, 1e-6);
  EXPECT_NEAR(suggestion.photos[1].shown, 1, 1e-6);
}

TEST(MaskSuggestion, LooksForWhatMasksDoNotShow) {
  const MaskSuggestion suggestion =
      SuggestPhotosToMask(Wall(), {false, false, true, false}, kAll, 1);
  EXPECT_NEAR(suggestion.shown, 12.5 / 21, 1e-6);
  EXPECT_THAT(ViewsOf(suggestion), ElementsAre(0));
}

TEST(MaskSuggestion, LeavesOutPhotosThatTheTrainingDoesNotUse) {
  EXPECT_THAT(ViewsOf(SuggestPhotosToMask(Wall(), kNone, {false, true, false, true}, 4)),
              ElementsAre(1, 3));
}

TEST(MaskSuggestion, AVoxelCountsOnceHoweverManyPointsItHas) {
  std::vector<ObservedPoint> points;
  AddRow(0, 21, {}, &points);
  AddRow(0, 4, {0}, &points);
  for (int i = 0; i < 100; ++i) points.push_back({Eigen::Vector3d(18.5, 0.5, 0.5), {1}});
  EXPECT_THAT(ViewsOf(SuggestPhotosToMask(points, {false, false}, {true, true}, 1)),
              ElementsAre(0));
}

TEST(MaskSuggestion, FarPointsDoNotCount) {
  std::vector<ObservedPoint> points;
  for (int k = 0; k < 10; ++k) AddRow(0, 21, {0}, &points);
  for (int i = 0; i < 3; ++i) points.push_back({Eigen::Vector3d(1e4 * (i + 1), 0, 0), {1}});
  const MaskSuggestion suggestion = SuggestPhotosToMask(points, {false, false}, {true, true}, 2);
  EXPECT_THAT(ViewsOf(suggestion), ElementsAre(0));
  EXPECT_NEAR(suggestion.photos[0].shown, 1, 1e-6);
}

TEST(MaskSuggestion, PartsCountByTheirWeight) {
  const std::vector<float> weight = {1, 2, 4, 0};
  const std::vector<std::vector<ShownPart>> shown_by = {
      {{0, 1.f}, {1, 1.f}}, {{2, 0.5f}}, {{2, 1.f}, {3, 1.f}}, {{3, 1.f}}};
  const MaskSuggestion suggestion = SuggestPhotosToMask(weight, shown_by, kNone, kAll, 4);
  // 4, then 3 of 7; the others add nothing.
  EXPECT_THAT(ViewsOf(suggestion), ElementsAre(2, 0));
  EXPECT_DOUBLE_EQ(suggestion.photos[0].shown, 4.0 / 7);
  EXPECT_DOUBLE_EQ(suggestion.photos[1].shown, 1);
  // A mask shows half of the heaviest part: as much is left of it as the first two have.
  const MaskSuggestion more =
      SuggestPhotosToMask(weight, shown_by, {false, true, false, false}, kAll, 1);
  EXPECT_DOUBLE_EQ(more.shown, 2.0 / 7);
  EXPECT_THAT(ViewsOf(more), ElementsAre(0));
  EXPECT_THAT(ViewsOf(SuggestPhotosToMask({0, 0, 0, 0}, shown_by, kNone, kAll, 4)), IsEmpty());
}

TEST(MaskSuggestion, NothingToSeeGivesNoSuggestion) {
  EXPECT_THAT(SuggestPhotosToMask({}, kNone, kAll, 3).photos, IsEmpty());
  EXPECT_THAT(SuggestPhotosToMask(Wall(), kAll, kAll, 3).photos, IsEmpty());
  // All points in one place.
  const std::vector<ObservedPoint> points(5, {Eigen::Vector3d(1, 2, 3), {3}});
  EXPECT_THAT(ViewsOf(SuggestPhotosToMask(points, kNone, kAll, 3)), ElementsAre(3));
}

}  // namespace
}  // namespace semfoam
