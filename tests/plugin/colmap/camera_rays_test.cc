// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/camera_rays.h"

#include "foam/model/activation.h"
#include "foam/view/pixel_reduction.h"

#include <cmath>

#include "tests/foam/random_cells.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// Cells of random colours, every third of them solid.
Foam SolidCells() {
  Foam foam;
  foam.positions = RandomSites(300, 7);
  for (int i = 0; i < 300; ++i) {
    CounterRandom random(7, 1, i);
    foam.raw_density.push_back(static_cast<float>(RawDensity(i % 3 == 0 ? 100 : 1e-4)));
    for (int c = 0; c < 3; ++c) foam.sh.push_back(static_cast<float>(2 * random.Uniform() - 1));
  }
  return foam;
}

// As large as needs more than one band at 4 x 4 rays a pixel.
Camera WideCamera(const std::string& model, const std::vector<double>& params) {
  Camera camera;
  camera.model_id = FindCameraModel(model)->id;
  camera.width = 170;
  camera.height = 121;
  camera.params = params;
  return camera;
}

void ExpectSame(const RenderedView& a, const RenderedView& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.color, b.color);
  EXPECT_EQ(a.opacity, b.opacity);
  EXPECT_EQ(a.distance, b.distance);
  EXPECT_EQ(a.class_index, b.class_index);
  EXPECT_EQ(a.confidence, b.confidence);
}

TEST(CameraRays, BandsOfRaysAreTheWholeView) {
  const Foam foam = SolidCells();
  const ViewRenderer renderer(foam);
  const Pose pose = {Eigen::Quaterniond(0.9, 0.1, -0.2, 0.3).normalized(),
                     Eigen::Vector3d(0.1, -0.2, 3)};
  const Similarity frame;
  const std::vector<Camera> cameras = {
      WideCamera("SIMPLE_RADIAL", {150, 85.3, 60.1, -0.08}),
      WideCamera("PINHOLE", {150, 140, 85.3, 60.1}),
      WideCamera("OPENCV_FISHEYE", {90, 91, 85, 60, 0.01, -0.002, 0, 0})};
  for (const Camera& camera : cameras) {
    const Camera fine = RescaledCamera(camera, 4 * camera.width, 4 * camera.height);
    RenderedView whole = renderer.Render(MakeCameraRays(camera, pose, frame));
    AverageRays(renderer.Render(MakeCameraRays(fine, pose, frame)), 4, &whole);
    ExpectSame(RenderCamera(renderer, camera, pose, frame, 4), whole);
    ExpectSame(RenderCamera(renderer, camera, pose, frame, 1),
               renderer.Render(MakeCameraRays(camera, pose, frame)));
  }
}

// An edge that runs through pixels: their colour is the share of it on either side.
TEST(CameraRays, PixelsAreAreas) {
  Foam foam;
  foam.positions = {{-0.25f, 0, 0}, {0.25f, 0, 0}};
  foam.raw_density.assign(2, static_cast<float>(RawDensity(1e4)));
  foam.sh = {-1.f, -1.f, -1.f, 1.f, 1.f, 1.f};
  const ViewRenderer renderer(foam);
  // The face x = 0 is seen at column 10.75 of 21.
  const Camera camera = [] {
    Camera pinhole;
    pinhole.model_id = FindCameraModel("PINHOLE")->id;
    pinhole.width = 21;
    pinhole.height = 3;
    pinhole.params = {20, 20, 10.75, 1.5};
    return pinhole;
  }();
  const Pose pose = {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 5)};
  const RenderedView view = RenderCamera(renderer, camera, pose, Similarity(), 4);
  const float left = view.color[21 + 9].x(), right = view.color[21 + 11].x();
  ASSERT_GT(right - left, 0.3f);
  EXPECT_NEAR((view.color[21 + 10].x() - left) / (right - left), 0.25f, 0.01f);
}

}  // namespace
}  // namespace semfoam
