// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/surface_views.h"

#include "foam/util/parallel.h"

#include <cmath>

#include "tests/plugin/test_util.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kSide = 96;
constexpr LabelId kWall{4}, kBoard{9};

// A wall at z = 10, of two large triangles that begin behind the cameras' images, and a board of 2
// x 2 before it at z = 5. Two cameras look along z, the second one from 3 to the right. The masks
// are exact.
class SurfaceViewsTest : public testing::Test {
 protected:
  void Take(int model_id, const std::vector<double>& params) {
    Camera camera;
    camera.id = 1;
    camera.model_id = model_id;
    camera.width = camera.height = kSide;
    camera.params = params;
    model_ = {};
    model_.cameras = {camera};
    for (int i = 0; i < 2; ++i) {
      Image image;
      image.id = i + 1;
      image.camera_id = 1;
      image.name = std::string(1, static_cast<char>('a' + i)) + ".jpg";
      image.cam_from_world.translation = {-3.0 * i, 0, 0};
      model_.images.push_back(image);
      std::vector<uint8_t> pixels;
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          const auto ray = Unproject(camera, {x + 0.5, y + 0.5});
          const Eigen::Vector3d at_board =
              ray ? Eigen::Vector3d(*ray * (5 / ray->z()) + Eigen::Vector3d(3.0 * i, 0, 0))
                  : Eigen::Vector3d(100, 0, 0);
          const bool is_board = std::max(std::abs(at_board.x()), std::abs(at_board.y())) < 1;
          pixels.push_back(static_cast<uint8_t>(Value(is_board ? kBoard : kWall)));
        }
      }
      WritePng(
          folder_ / image.name.replace(2, 3, "png"), kSide, kSide, 8, PNG_COLOR_TYPE_GRAY, pixels);
    }
    const std::vector<PhotoRecord> records = RegisteredPhotos(model_);
    photos_ = LoadCorrectedPhotos(model_,
                                  records,
                                  PairMasks(folder_.path(), {"a.jpg", "b.jpg"}),
                                  folder_.path(),
                                  LabelZero::kAuto,
                                  MaskConsistency::kOff);
  }

  LabelId LabelAt(const SurfaceViews& views, const Eigen::Vector3d& x, int* num_views) {
    const MaskVerdict verdict = views.Vote(x, {0, 0, 1});
    *num_views = verdict.num_views;
    return LabelIdOf(photos_.photos.labels, verdict.class_index);
  }

  void ExpectRight(const SurfaceViews& views) {
    int num_views = 0;
    EXPECT_EQ(LabelAt(views, {0.5, 0.5, 5}, &num_views), kBoard);
    EXPECT_EQ(num_views, 2);
    EXPECT_EQ(LabelAt(views, {1, 3.5, 10}, &num_views), kWall);
    EXPECT_EQ(num_views, 2);
    // Behind the board: hidden from the first camera, seen by the second one.
    EXPECT_EQ(LabelAt(views, {0.3, 0.3, 10}, &num_views), kWall);
    EXPECT_EQ(num_views, 1);
    // Behind the wall, behind the cameras, and nowhere.
    EXPECT_EQ(LabelAt(views, {0.3, 0.3, 12}, &num_views), kNoObject);
    EXPECT_EQ(num_views, 0);
    LabelAt(views, {0, 0, -5}, &num_views);
    EXPECT_EQ(num_views, 0);
    LabelAt(views, {std::nan(""), 0, 5}, &num_views);
    EXPECT_EQ(num_views, 0);
  }

  TempFolder folder_;
  Reconstruction model_;
  CorrectedPhotos photos_;
  const std::vector<Eigen::Vector3d> vertices_ = {{-60, -60, 10},
                                                  {60, -60, 10},
                                                  {60, 60, 10},
                                                  {-60, 60, 10},
                                                  {-1, -1, 5},
                                                  {1, -1, 5},
                                                  {1, 1, 5},
                                                  {-1, 1, 5},
                                                  {std::nan(""), 0, 1}};
  const std::vector<std::array<uint32_t, 3>> triangles_ = {
      {0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}, {0, 1, 8}};
};

TEST_F(SurfaceViewsTest, HiddenPlacesHaveNoVote) {
  Take(1, {50, 50, 48, 48});
  const SurfaceViews views(model_, photos_, vertices_, triangles_);
  ExpectRight(views);
  EXPECT_NEAR(views.PixelSize({0, 0, 5}), 5.0 / 50, 0.01);
  EXPECT_EQ(views.PixelSize({0.3, 0.3, 12}), 0);
}

TEST_F(SurfaceViewsTest, LensesMayDistort) {
  Take(2, {50, 48, 48, 0.05});  // SIMPLE_RADIAL
  ExpectRight(SurfaceViews(model_, photos_, vertices_, triangles_));
  Take(5, {50, 50, 48, 48, 0.01, 0, 0, 0});  // OPENCV_FISHEYE
  ExpectRight(SurfaceViews(model_, photos_, vertices_, triangles_));
}

// Points hide as triangles do, where they are dense.
TEST_F(SurfaceViewsTest, PointsHidePoints) {
  Take(1, {50, 50, 48, 48});
  std::vector<Eigen::Vector3d> points;
  for (double x = -20; x < 20; x += 0.1) {
    for (double y = -20; y < 20; y += 0.1) points.emplace_back(x, y, 10);
  }
  for (double x = -1; x < 1; x += 0.02) {
    for (double y = -1; y < 1; y += 0.02) points.emplace_back(x, y, 5);
  }
  ExpectRight(SurfaceViews(model_, photos_, points, {}));
}

// Votes near the border of a region, and at a grazing angle, weigh less.
TEST_F(SurfaceViewsTest, VotesAreWeighted) {
  Take(1, {50, 50, 48, 48});
  const SurfaceViews views(model_, photos_, vertices_, triangles_);
  const MaskVerdict inside = views.Vote({0.5, 0.5, 5}, {0, 0, -1});
  EXPECT_EQ(inside.confidence, 1);
  // Just outside of the board, as a place of its own on its edge: one photo says board.
  const Eigen::Vector3d edge(0.985, 0, 5.0);
  EXPECT_EQ(LabelIdOf(photos_.photos.labels, views.Vote(edge, {0, 0, 0}).class_index), kBoard);
}

TEST_F(SurfaceViewsTest, TheSameOnAnyNumberOfThreads) {
  Take(2, {50, 48, 48, 0.05});
  std::vector<float> confidences[2];
  for (const int threads : {1, 3}) {
    const ThreadLimit limit(threads);
    const SurfaceViews views(model_, photos_, vertices_, triangles_);
    for (double x = -3; x < 6; x += 0.37) {
      confidences[threads == 1 ? 0 : 1].push_back(views.Vote({x, 0.9, 10}, {0, 0, 1}).confidence);
    }
  }
  EXPECT_EQ(confidences[0], confidences[1]);
}

}  // namespace
}  // namespace semfoam
