// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_findings.h"

#include "plugin/mask/mask_survey.h"

#include <algorithm>
#include <cmath>

#include "tests/mistake.h"
#include "tests/plugin/mask/wall.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

std::vector<MaskFinding> Findings(const MaskedPhotos& photos) {
  return FindMaskFaults(photos, LabelPoints(photos));
}

std::vector<int> Ids(const MaskedPhotos& photos, const MaskFinding& finding) {
  std::vector<int> ids;
  for (const ClassIndex c : finding.classes) ids.push_back(Value(photos.labels[Value(c)].id));
  return ids;
}

int GivenId(const MaskedPhotos& photos, const MaskFinding& finding) {
  return finding.given_class == kUnlabelled
             ? -1
             : Value(photos.given.labels[Value(finding.given_class)].id);
}

TEST(MaskFindings, RightMasksHaveNone) {
  Wall wall;
  EXPECT_THAT(Findings(wall.HeldAgainstTracks()), IsEmpty());
}

TEST(MaskFindings, SaysWhatIsWrongWithEachRegion) {
  Wall wall;
  wall.PaintBand(1, 0, 0);  // lost
  wall.PaintBand(3, 0, 8);  // traded
  wall.PaintBand(3, 1, 7);
  wall.PaintBand(5, 2, 8);   // merged
  wall.PaintBand(6, 2, 40);  // an id of its own
  wall.Paint(8, kHeight - 3, 100, 103, [](int) { return 61; });
  const MaskedPhotos photos = wall.HeldAgainstTracks();
  const std::vector<MaskFinding> findings = Findings(photos);
  ASSERT_THAT(findings, SizeIs(6));
  const auto expect = [&](int i, int view, MaskFault fault, int given, std::vector<int> ids) {
    EXPECT_EQ(findings[i].view, view) << i;
    EXPECT_EQ(FaultName(findings[i].fault), FaultName(fault)) << i;
    EXPECT_EQ(GivenId(photos, findings[i]), given) << i;
    EXPECT_EQ(Ids(photos, findings[i]), ids) << i;
  };
  expect(0, 1, MaskFault::kMissing, -1, {7});
  expect(1, 3, MaskFault::kSwitched, 7, {8});
  expect(2, 3, MaskFault::kSwitched, 8, {7});
  expect(3, 5, MaskFault::kMerged, 8, {8, 9});
  expect(4, 6, MaskFault::kNewId, 40, {9});
  expect(5, 8, MaskFault::kFragment, 61, {});
  for (int i = 0; i < 5; ++i) EXPECT_GT(findings[i].num_points, 3) << i;
  EXPECT_EQ(findings[5].num_points, 0);
  EXPECT_NEAR(findings[3].share, 2.0 / 3, 1e-9);
  EXPECT_NEAR(findings[5].share, 9.0 / (kWidth * kHeight), 1e-9);
}

// Where id 0 is the background, an object lost in it is still missing.
TEST(MaskFindings, AnObjectLostInTheBackgroundIsMissing) {
  Wall wall;
  for (int view = 0; view < kViews; ++view) wall.PaintBand(view, 2, 0);
  wall.PaintBand(4, 0, 0);
  const MaskedPhotos photos = wall.HeldAgainstTracks(/*zero_is_class=*/true);
  const std::vector<MaskFinding> findings = Findings(photos);
  ASSERT_THAT(findings, SizeIs(1));
  EXPECT_EQ(findings[0].fault, MaskFault::kMissing);
  EXPECT_EQ(findings[0].view, 4);
  EXPECT_THAT(Ids(photos, findings[0]), ElementsAre(7));
}

TEST(MaskFindings, WithoutTracksThereAreNone) {
  Wall wall(/*num_points=*/0);
  wall.PaintBand(1, 0, 0);
  wall.PaintBand(3, 0, 8);
  EXPECT_THAT(Findings(wall.HeldAgainstTracks()), IsEmpty());
}

TEST(MaskFindings, UnusableMasksComeFirstThenTheHeaviest) {
  const auto finding = [](int32_t view, MaskFault fault, int points, double share) {
    MaskFinding f;
    f.view = view;
    f.fault = fault;
    f.num_points = points;
    f.share = share;
    return f;
  };
  const std::vector<SuspiciousPhoto> ranked = RankPhotos({
      finding(0, MaskFault::kMerged, 20, 0.1),
      finding(1, MaskFault::kFragment, 0, 0.5),  // as 50 points
      finding(2, MaskFault::kNone, 0, 0),
      finding(3, MaskFault::kMissing, 15, 0),
      finding(3, MaskFault::kSwitched, 16, 0.1),
      finding(4, MaskFault::kSwitched, 20, 0.1),
  });
  std::vector<int> views;
  for (const SuspiciousPhoto& photo : ranked) views.push_back(photo.view);
  EXPECT_THAT(views, ElementsAre(2, 1, 3, 0, 4));
  EXPECT_EQ(ranked[2].weight, 31);
  EXPECT_EQ(ranked[2].findings.front().fault, MaskFault::kSwitched);
}

TEST(MaskFindingsSurvey, TellsFormatsAndWhatIsUnreadable) {
  const TempFolder folder;
  const std::vector<uint8_t> grey(16 * 8, 5);
  WritePng(folder / "grey.png", 16, 8, 8, PNG_COLOR_TYPE_GRAY, grey);
  WritePng(
      folder / "palette.png", 16, 8, 4, PNG_COLOR_TYPE_PALETTE, std::vector<uint8_t>(64, 0x21));
  WritePng(folder / "wide.png", 4, 8, 16, PNG_COLOR_TYPE_GRAY, std::vector<uint8_t>(64, 1));
  WritePng(folder / "rgb.png", 16, 8, 8, PNG_COLOR_TYPE_RGB, std::vector<uint8_t>(16 * 8 * 3, 7));
  WriteFile(folder / "text.png", "no image");
  const std::vector<MaskFile> files = SurveyMasks({folder / "grey.png",
                                                   folder / "palette.png",
                                                   folder / "wide.png",
                                                   folder / "rgb.png",
                                                   folder / "text.png",
                                                   ""});
  EXPECT_EQ(files[0].format, "8-bit grey");
  EXPECT_EQ(files[0].size, (PhotoSize{16, 8}));
  EXPECT_EQ(files[1].format, "4-bit palette");
  EXPECT_EQ(files[2].format, "16-bit grey");
  EXPECT_EQ(files[2].size, (PhotoSize{4, 8}));
  EXPECT_EQ(files[3].format, "24-bit colour");
  EXPECT_EQ(files[4].format, "");
  EXPECT_THAT(files[4].error, NamesMistake("", {}, "is no PNG file"));
  EXPECT_EQ(files[5].format + files[5].error, "");
}

TEST(MaskFindingsSurvey, CountsWhatEachIdCovers) {
  Wall wall;
  wall.PaintBand(2, 1, 7);
  wall.PaintBand(3, 0, 0);
  wall.PaintBand(3, 1, 0);
  MaskedPhotos photos;
  photos.photos = wall.photos;
  const PaintedMasks masks = wall.Painted();
  photos.given.labels = masks.labels;
  photos.pairing.masks.assign(kViews, "mask.png");
  photos.pairing.masks[11].clear();
  for (int view = 0; view < kViews; ++view) {
    const ClassImage image = view == 11 ? ClassImage() : masks.classes[view];
    photos.pixels.push_back(LookAtMask(image, wall.photos[view], {}).pixels_of);
  }
  const CoverageSurvey survey = SurveyCoverage(photos);
  ASSERT_THAT(survey.ids, SizeIs(3));
  EXPECT_THAT(survey.ids[0].views, ElementsAre(0, 1, 2, 4, 5, 6, 7, 8, 9, 10));
  EXPECT_NEAR(survey.ids[0].least, 1.0 / 3, 1e-9);
  EXPECT_NEAR(survey.ids[0].median, 1.0 / 3, 1e-9);
  EXPECT_NEAR(survey.ids[0].most, 2.0 / 3, 1e-9);
  EXPECT_THAT(survey.ids[2].views, SizeIs(11));
  EXPECT_NEAR(survey.unlabelled[3], 2.0 / 3, 1e-9);
  EXPECT_EQ(survey.unlabelled[4], 0);
  EXPECT_TRUE(std::isnan(survey.unlabelled[11]));
}

}  // namespace
}  // namespace semfoam
