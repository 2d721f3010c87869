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

TEST(PhotoLight, RadiusIsOneInTheCorners) {
  EXPECT_DOUBLE_EQ(SquaredRadius({0, 0}, 640, 480), 1);
  EXPECT_DOUBLE_EQ(SquaredRadius({640, 480}, 640, 480), 1);
  EXPECT_DOUBLE_EQ(SquaredRadius({320, 240}, 640, 480), 0);
  EXPECT_DOUBLE_EQ(SquaredRadius({640, 240}, 640, 480), 0.64);
}

TEST(PhotoLight, FallsOffTowardsTheCorners) {
  const PhotoLight light{{2, 1, 0.5}, {-0.1, -0.2}};
  EXPECT_DOUBLE_EQ(LightAt(light, 0).x(), 2);
  EXPECT_DOUBLE_EQ(LightAt(light, 1).y(), std::exp(-0.3));
  EXPECT_DOUBLE_EQ(LightAt(light, 0.5).z(), 0.5 * std::exp(-0.1));
}

TEST(PhotoLight, ReferenceColorUndoesWhatTheCameraDid) {
  const Eigen::Vector3d gain(1.3, 0.8, 0.6);
  const PhotoLight light{gain, {0, 0}};
  for (int value = 20; value < 220; ++value) {
    Image8 photo{1, 1, {uint8_t(value), uint8_t(value), uint8_t(value)}};
    ChangePhoto(gain, 0, {0, 0}, &photo);
    const Eigen::Vector3f color = ReferenceColor(photo.data.data(), light, 0);
    // Half a step of the darkened photo is most of one here.
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(255 * color[c], value, 0.8) << c;
  }
}

TEST(PhotoLight, WithoutChangeColoursStay) {
  for (int value = 0; value < 256; ++value) {
    const uint8_t rgb[3] = {uint8_t(value), uint8_t(value), 7};
    const Eigen::Vector3f color = ReferenceColor(rgb, PhotoLight(), 0.3);
    EXPECT_NEAR(color.x(), value / 255.0, 1e-6);
  }
}

TEST(PhotoLight, WhiteStaysWhiteOrIsNotKnown) {
  const uint8_t white[3] = {255, 255, 255};
  const uint8_t one_channel[3] = {254, 100, 100};
  // A dark photo: more than white is white, as in any photo.
  const PhotoLight dark{{0.7, 0.7, 0.7}, {0, 0}};
  EXPECT_EQ(ReferenceColor(white, dark, 0), Eigen::Vector3f::Ones());
  // A bright one: what is behind 255 may be anything from there on.
  const PhotoLight bright{{1.4, 1.4, 1.4}, {0, 0}};
  EXPECT_FALSE(ReferenceColor(white, bright, 0).allFinite());
  EXPECT_FALSE(ReferenceColor(one_channel, bright, 0).allFinite());
  // So little brighter that nobody sees it.
  const PhotoLight hardly{{1.02, 1.02, 1.02}, {0, 0}};
  EXPECT_TRUE(ReferenceColor(white, hardly, 0).allFinite());
  EXPECT_GT(ReferenceColor(white, hardly, 0).minCoeff(), 0.98);
}

}  // namespace
}  // namespace semfoam
