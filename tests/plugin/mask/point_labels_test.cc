// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/point_labels.h"

#include <functional>
#include <utility>

#include "tests/plugin/mask/wall.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kSide = 64;

// Photos of 64 x 64 pixels with masks of the classes 0, 1 and 2, which are believed.
class Votes {
 public:
  // Adds a photo whose mask has class `of(x, y)`, and returns its view.
  int32_t AddPhoto(const std::function<int32_t(int x, int y)>& of) {
    PhotoRecord photo;
    photo.width = photo.height = kSide;
    photos.photos.push_back(photo);
    ClassImage image({kSide, kSide}, 3);
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) image.Set(y * kSide + x, ClassIndex{of(x, y)});
    }
    masks.push_back(std::move(image));
    return static_cast<int32_t>(photos.photos.size()) - 1;
  }
  int32_t AddUniform(int32_t class_index) {
    return AddPhoto([=](int, int) { return class_index; });
  }
  // The left half is class 1, the right half class 2.
  int32_t AddHalves() {
    return AddPhoto([](int x, int) { return x < kSide / 2 ? 1 : 2; });
  }

  PointLabel Label(const PixelObservations& observations) {
    photos.observations = {observations};
    CollectObservations([&](int view) { return ViewMasks{masks[view], masks[view]}; }, &photos);
    return LabelPoints(photos).front();
  }

  MaskedPhotos photos;
  std::vector<ClassImage> masks;
};

const Eigen::Vector2d kMiddle(31.5, 31.5);

TEST(PointLabels, TheMajorityWins) {
  Votes votes;
  const int32_t a = votes.AddUniform(1), b = votes.AddUniform(2), c = votes.AddUniform(2);
  const PointLabel label = votes.Label({{a, kMiddle}, {b, kMiddle}, {c, kMiddle}});
  EXPECT_EQ(label.class_index, ClassIndex{2});
  EXPECT_FLOAT_EQ(label.confidence, 2.f / 3);
}

TEST(PointLabels, OneVoteNearABorderWeighsLessThanOneFarFromIt) {
  Votes votes;
  const int32_t halves = votes.AddHalves(), one = votes.AddUniform(1);
  // Pixel 32 touches the border: (0 + 1/2) of (4 + 1/2).
  PointLabel label = votes.Label({{halves, {32.5, 20}}, {one, kMiddle}});
  EXPECT_EQ(label.class_index, ClassIndex{1});
  EXPECT_FLOAT_EQ(label.confidence, 1 / (1 + 0.5f / 4.5f));
  // Two pixels in: (2 + 1/2).
  label = votes.Label({{halves, {34.5, 20}}, {one, kMiddle}});
  EXPECT_FLOAT_EQ(label.confidence, 1 / (1 + 2.5f / 4.5f));
  // From four pixels on the weight is full.
  label = votes.Label({{halves, {36.5, 20}}, {one, kMiddle}});
  EXPECT_FLOAT_EQ(label.confidence, 0.5f);
  // Two votes at the border are outvoted by one that is safe.
  label = votes.Label({{halves, {32.1, 20}}, {halves, {32.1, 40}}, {one, kMiddle}});
  EXPECT_EQ(label.class_index, ClassIndex{1});
}

TEST(PointLabels, ALoneVoteAtABorderStillCounts) {
  Votes votes;
  const int32_t halves = votes.AddHalves();
  const PointLabel label = votes.Label({{halves, {32.1, 20}}});
  EXPECT_EQ(label.class_index, ClassIndex{2});
  EXPECT_FLOAT_EQ(label.confidence, 1);
}

TEST(PointLabels, OfATieTheFirstClassWinsWhateverTheOrder) {
  Votes votes;
  const int32_t one = votes.AddUniform(1), two = votes.AddUniform(2);
  for (const PixelObservations& observations :
       {PixelObservations{{one, kMiddle}, {two, kMiddle}},
        PixelObservations{{two, kMiddle}, {one, kMiddle}}}) {
    const PointLabel label = votes.Label(observations);
    EXPECT_EQ(label.class_index, ClassIndex{1});
    EXPECT_FLOAT_EQ(label.confidence, 0.5f);
  }
}

TEST(PointLabels, WithoutAMaskThereIsNoLabel) {
  Votes votes;
  const int32_t nothing = votes.AddUniform(Value(kUnlabelled)), two = votes.AddUniform(2);
  votes.photos.photos.push_back(votes.photos.photos.front());
  votes.masks.emplace_back();
  const int32_t without = 2;
  for (const PixelObservations& observations :
       {PixelObservations{},
        PixelObservations{{without, kMiddle}},
        PixelObservations{{nothing, kMiddle}},
        PixelObservations{{two, {-1, 5}}, {two, {5, kSide}}, {two, {NAN, 1}}}}) {
    const PointLabel label = votes.Label(observations);
    EXPECT_EQ(label.class_index, kUnlabelled);
    EXPECT_EQ(label.confidence, 0);
  }
  // Where a tracker has lost a thing it says nothing of it: one vote is all there are.
  const PointLabel label = votes.Label({{nothing, kMiddle}, {without, kMiddle}, {two, kMiddle}});
  EXPECT_EQ(label.class_index, ClassIndex{2});
  EXPECT_EQ(label.confidence, 1);
}

TEST(PointLabels, RegionsThatTheTracksContradictWeighLess) {
  Votes votes;
  const int32_t one = votes.AddUniform(1), two = votes.AddUniform(2);
  RegionReport trusted, doubted;
  trusted.view = two;
  trusted.given_class = ClassIndex{2};
  trusted.num_judged = trusted.num_agreeing = 8;  // 9 / 10
  doubted.view = one;
  doubted.given_class = ClassIndex{1};
  doubted.num_judged = 8;
  doubted.num_agreeing = 2;  // 3 / 10
  votes.photos.consistency.regions = {doubted, trusted};
  const PointLabel label = votes.Label({{one, kMiddle}, {two, kMiddle}});
  EXPECT_EQ(label.class_index, ClassIndex{2});
  EXPECT_FLOAT_EQ(label.confidence, 0.75f);
}

// Ids that a tracker has changed on the way are one label; a plain vote would have two.
TEST(PointLabels, RenamedIdsVoteForWhatTheyAre) {
  Wall wall;
  for (int view = 5; view < kViews; ++view) wall.PaintBand(view, 1, 50);
  wall.PaintBand(3, 0, 9);  // and one that is wrong
  const MaskedPhotos photos = wall.HeldAgainstTracks();
  const std::vector<PointLabel> labels = LabelPoints(photos);
  int wrong = 0;
  for (size_t i = 0; i < labels.size(); ++i) {
    ASSERT_NE(labels[i].class_index, kUnlabelled);
    const int band = static_cast<int>(wall.tracks[i].front().pixel.x()) / kBand;
    // Id 50 is in more photos than 8, so it is the label of both.
    const int id = Value(photos.labels[Value(labels[i].class_index)].id);
    wrong += id != (band == 0 ? 7 : band == 1 ? 50 : 9);
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(photos.labels.size(), 3u);
}

}  // namespace
}  // namespace semfoam
