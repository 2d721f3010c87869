// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photo/photo_light.h"

#include "foam/image/srgb.h"

#include <cmath>

#include "tests/plugin/photo/changed_photos.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

TEST(PhotoLight, SrgbGoesThereAndBack) {
  EXPECT_DOUBLE_EQ(LinearFromDisplay(1.0), 1);
  EXPECT_DOUBLE_EQ(LinearFromDisplay(0.0), 0);
  // 118 of 255 is a photographer's grey GPU, 18 % of the light.
  EXPECT_NEAR(LinearFromDisplay(118 / 255.0), 0.18, 0.002);
  for (int i = 0; i <= 255; ++i) {
    EXPECT_NEAR(255 * DisplayFromLinear(LinearFromDisplay(i / 255.0)), i, 1e-5);
    EXPECT_NEAR(255 * DisplayFromLinear(LinearFromDisplay(i / 255.0f)), i, 1e-3);
  }
}

TEST(PhotoLight, PlacesAreOneFromTheMiddleInTheCorners) {
  EXPECT_EQ(PlaceInPhoto({0, 0}, 640, 480), Eigen::Vector2d(-0.8, -0.6));
  EXPECT_EQ(PlaceInPhoto({640, 480}, 640, 480), Eigen::Vector2d(0.8, 0.6));
  EXPECT_EQ(PlaceInPhoto({320, 240}, 640, 480), Eigen::Vector2d(0, 0));
  EXPECT_EQ(PlaceInPhoto({640, 240}, 640, 480), Eigen::Vector2d(0.8, 0));
}

TEST(PhotoLight, FallsOffTowardsTheCorners) {
  const PhotoLight light{{2, 1, 0.5}, {-0.1, -0.2}};
  EXPECT_DOUBLE_EQ(LightAt(light, {0, 0}).x(), 2);
  EXPECT_DOUBLE_EQ(LightAt(light, {-0.8, 0.6}).y(), std::exp(-0.3));
  EXPECT_DOUBLE_EQ(LightAt(light, {0, std::sqrt(0.5)}).z(), 0.5 * std::exp(-0.1));
}

TEST(PhotoLight, ShadingIsAPolynomialOfDegreeTwo) {
  PhotoLight light;
  light.gain = {1, 2, 3};
  light.shading << 0.5, 0, 0, 0, 0, 0, -0.25, 0, 0, 0, 0.1, 0.2, 0.3, 0.4, 0.5;
  const Eigen::Vector3d there = LightAt(light, {0.6, -0.4});
  EXPECT_DOUBLE_EQ(there.x(), std::exp(0.3));
  EXPECT_DOUBLE_EQ(there.y(), 2 * std::exp(0.1));
  EXPECT_DOUBLE_EQ(there.z(), 3 * std::exp(0.06 - 0.08 + 0.3 * 0.36 - 0.4 * 0.24 + 0.5 * 0.16));
}

TEST(PhotoLight, ReferenceColorUndoesALampThatMoved) {
  constexpr int kWidth = 64, kHeight = 48;
  const Eigen::Vector2d slopes(0.4, -0.3);
  PhotoLight light;
  // From slopes over the width to slopes over half the diagonal.
  light.shading.leftCols<2>().rowwise() =
      slopes.transpose() * (0.5 * std::hypot(kWidth, kHeight) / kWidth);
  Image8 photo{kWidth, kHeight, std::vector<uint8_t>(3 * kWidth * kHeight, 120)};
  ChangePhoto({}, Eigen::Vector3d::Ones(), slopes, &photo);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Eigen::Vector3f color =
          ReferenceColor(&photo.data[3 * (static_cast<size_t>(y) * kWidth + x)],
                         light,
                         PlaceInPhoto({x + 0.5, y + 0.5}, kWidth, kHeight));
      EXPECT_NEAR(255 * color.x(), 120, 0.8) << x << " " << y;
    }
  }
}

TEST(PhotoLight, ReferenceColorUndoesWhatTheCameraDid) {
  const Eigen::Vector3d gain(1.3, 0.8, 0.6);
  const PhotoLight light{gain, {0, 0}};
  for (int value = 20; value < 220; ++value) {
    Image8 photo{1, 1, {uint8_t(value), uint8_t(value), uint8_t(value)}};
    ChangePhoto({}, gain, {0, 0}, &photo);
    const Eigen::Vector3f color = ReferenceColor(photo.data.data(), light, {0, 0});
    // Half a step of the darkened photo is most of one here.
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(255 * color[c], value, 0.8) << c;
  }
}

TEST(PhotoLight, WithoutChangeColoursStay) {
  for (int value = 0; value < 256; ++value) {
    const uint8_t rgb[3] = {uint8_t(value), uint8_t(value), 7};
    const Eigen::Vector3f color = ReferenceColor(rgb, PhotoLight(), {0.3, 0.4});
    EXPECT_NEAR(color.x(), value / 255.0, 1e-6);
  }
}

TEST(PhotoLight, WhiteStaysWhiteOrIsNotKnown) {
  const uint8_t white[3] = {255, 255, 255};
  const uint8_t one_channel[3] = {254, 100, 100};
  // A dark photo: more than white is white, as in any photo.
  const PhotoLight dark{{0.7, 0.7, 0.7}, {0, 0}};
  EXPECT_EQ(ReferenceColor(white, dark, {0, 0}), Eigen::Vector3f::Ones());
  // A bright one: what is behind 255 may be anything from there on.
  const PhotoLight bright{{1.4, 1.4, 1.4}, {0, 0}};
  EXPECT_FALSE(ReferenceColor(white, bright, {0, 0}).allFinite());
  EXPECT_FALSE(ReferenceColor(one_channel, bright, {0, 0}).allFinite());
  // At least what white is in this light, then.
  uint8_t at_least = 0;
  const Eigen::Vector3f least = LeastReferenceColor(white, bright, {0, 0}, &at_least);
  EXPECT_EQ(at_least, 7);
  EXPECT_GT(least.minCoeff(), 0.8);
  EXPECT_LT(least.maxCoeff(), 0.9);
  // 254, not 255.
  EXPECT_NEAR(LeastReferenceColor(one_channel, bright, {0, 0}, &at_least).x(), least.x(), 0.005);
  EXPECT_EQ(at_least, 1);
  EXPECT_EQ(LeastReferenceColor(white, dark, {0, 0}, &at_least), Eigen::Vector3f::Ones());
  EXPECT_EQ(at_least, 0);
  // A tone mixes the channels, so that none has a bound.
  PhotoLight toned = bright;
  toned.tone(0, 1) = 0.1;
  EXPECT_FALSE(LeastReferenceColor(one_channel, toned, {0, 0}, &at_least).allFinite());
  EXPECT_EQ(at_least, 0);
  // So little brighter that nobody sees it.
  const PhotoLight hardly{{1.02, 1.02, 1.02}, {0, 0}};
  EXPECT_TRUE(ReferenceColor(white, hardly, {0, 0}).allFinite());
  EXPECT_GT(ReferenceColor(white, hardly, {0, 0}).minCoeff(), 0.98);
}

TEST(PhotoLight, PhotographedColorUndoesReferenceColor) {
  PhotoLight light{{1.3, 0.9, 0.6}, {-0.2, -0.1}};
  light.shading.setConstant(0.2);
  const Eigen::Vector2d place(0.5, -0.3);
  for (int value = 5; value < 190; ++value) {
    const uint8_t rgb[3] = {uint8_t(value), uint8_t(value / 2), uint8_t(value / 3)};
    const Eigen::Vector3f color =
        PhotographedColor(ReferenceColor(rgb, light, place), light, place);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(255 * color[c], rgb[c], 1e-3) << value << " " << c;
  }
}

TEST(PhotoLight, TonesLeaveGreyAndAreUndone) {
  Eigen::Matrix3d tone = 1.2 * Eigen::Matrix3d::Identity();
  tone.array() -= 0.06;
  const Eigen::Vector3d grey = Eigen::Vector3d::Constant(kMidGrey);
  EXPECT_LT((Toned(grey, tone) - grey).norm(), 1e-15);
  const Eigen::Vector3d light(0.4, 0.1, 0.02);
  EXPECT_LT((Toned(Toned(light, tone), tone.inverse()) - light).norm(), 1e-12);
  // More contrast, more saturation.
  EXPECT_GT(Toned(light, tone)[0] / Toned(light, tone)[2], 1.5 * light[0] / light[2]);
  EXPECT_EQ(Toned({0, -1, 0.5}, Eigen::Matrix3d::Identity()), Eigen::Vector3d(0, -1, 0.5));
  EXPECT_TRUE(Toned({0, 0, 0}, tone).allFinite());
  PhotoLight lens{{1.1, 1, 0.9}, {-0.2, 0}};
  lens.tone = tone;
  for (int value = 20; value < 200; ++value) {
    const uint8_t rgb[3] = {uint8_t(value), uint8_t(value / 2 + 10), uint8_t(value / 3 + 10)};
    const Eigen::Vector3f color =
        PhotographedColor(ReferenceColor(rgb, lens, {0.2, 0.3}), lens, {0.2, 0.3});
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(255 * color[c], rgb[c], 1e-2) << value << " " << c;
  }
}

TEST(PhotoLight, PhotographedColorIsNoBrighterThanWhiteAndKeepsWhite) {
  const PhotoLight dark{{0.7, 0.7, 0.7}, {0, 0}};
  const PhotoLight bright{{1.4, 1.4, 1.4}, {0, 0}};
  const auto grey = [](float value) { return Eigen::Vector3f::Constant(value).eval(); };
  EXPECT_EQ(PhotographedColor(grey(1), dark, {0, 0}), grey(1));
  EXPECT_EQ(PhotographedColor(grey(1.2f), dark, {0, 0}), grey(1));
  EXPECT_EQ(PhotographedColor(grey(0.95f), bright, {0, 0}), grey(1));
  EXPECT_EQ(PhotographedColor(grey(-0.1f), bright, {0, 0}), grey(0));
  // Without a jump on the way to white, and one channel alone is no white.
  float before = 0;
  for (int i = 0; i <= 1000; ++i) {
    const float value = PhotographedColor(grey(0.001f * i), dark, {0, 0}).x();
    EXPECT_GE(value, before);
    EXPECT_LT(value - before, 0.011f) << i;
    before = value;
  }
  EXPECT_LT(PhotographedColor({1, 0.5f, 0.2f}, dark, {0, 0}).x(), 0.87f);
}

}  // namespace
}  // namespace semfoam
