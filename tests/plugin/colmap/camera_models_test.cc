// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/camera_models.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "tests/plugin/colmap/lenses.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<Camera> AllRealisticCameras() {
  std::vector<Camera> cameras = RealisticCameras();
  for (const Camera& camera : LaterCameras()) cameras.push_back(camera);
  return cameras;
}

TEST(CameraModels, TheTableIsTheDocumentedOne) {
  const std::vector<std::pair<std::string, int>> documented = {{"SIMPLE_PINHOLE", 3},
                                                               {"PINHOLE", 4},
                                                               {"SIMPLE_RADIAL", 4},
                                                               {"RADIAL", 5},
                                                               {"OPENCV", 8},
                                                               {"OPENCV_FISHEYE", 8},
                                                               {"FULL_OPENCV", 12},
                                                               {"FOV", 5},
                                                               {"SIMPLE_RADIAL_FISHEYE", 4},
                                                               {"RADIAL_FISHEYE", 5},
                                                               {"THIN_PRISM_FISHEYE", 12},
                                                               {"RAD_TAN_THIN_PRISM_FISHEYE", 16},
                                                               {"SIMPLE_DIVISION", 4},
                                                               {"DIVISION", 5},
                                                               {"SIMPLE_FISHEYE", 3},
                                                               {"FISHEYE", 4},
                                                               {"EUCM", 6},
                                                               {"EQUIRECTANGULAR", 2}};
  for (int id = 0; id < static_cast<int>(documented.size()); ++id) {
    const CameraModel* model = FindCameraModel(id);
    ASSERT_NE(model, nullptr);
    EXPECT_EQ(model->id, id);
    EXPECT_EQ(model->name, documented[id].first);
    EXPECT_EQ(model->num_params, documented[id].second);
    EXPECT_EQ(FindCameraModel(model->name), model);
  }
  EXPECT_EQ(FindCameraModel(-1), nullptr);
  EXPECT_EQ(FindCameraModel(18), nullptr);
  EXPECT_EQ(FindCameraModel("FISHY"), nullptr);
}

TEST(CameraModels, UnprojectionInvertsProjectionOverTheWholeImage) {
  for (const Camera& camera : AllRealisticCameras()) {
    SCOPED_TRACE(NameOf(camera));
    int rays = 0;
    for (double y = 0; y <= static_cast<double>(camera.height); y += 10) {
      for (double x = 0; x <= static_cast<double>(camera.width); x += 10) {
        const auto ray = Unproject(camera, {x, y});
        ASSERT_TRUE(ray) << x << " " << y;
        EXPECT_NEAR(ray->norm(), 1, 1e-12);
        const auto pixel = Project(camera, 3.7 * *ray);
        ASSERT_TRUE(pixel);
        EXPECT_LT((*pixel - Vector2d(x, y)).norm(), 1e-6) << x << " " << y;
        ++rays;
      }
    }
    EXPECT_EQ(rays, 65 * 49);
  }
}

TEST(CameraModels, ProjectionInvertsUnprojectionInSpace) {
  for (const Camera& camera : AllRealisticCameras()) {
    SCOPED_TRACE(NameOf(camera));
    for (double angle = 0; angle < 6; angle += 0.5) {
      for (const double theta : {0.0, 1e-9, 0.05, 0.2, 0.35}) {
        const Vector3d ray(
            std::sin(theta) * std::cos(angle), std::sin(theta) * std::sin(angle), std::cos(theta));
        const auto pixel = Project(camera, 0.01 * ray);
        ASSERT_TRUE(pixel);
        const auto back = Unproject(camera, *pixel);
        ASSERT_TRUE(back);
        EXPECT_LT((*back - ray).norm(), 1e-10);
      }
    }
  }
}

// Each formula once more, from the documentation's words and by hand for one point.
TEST(CameraModels, ProjectsByTheDocumentedFormulas) {
  const Vector3d x(0.6, -0.4, 2);  // u = 0.3, v = -0.2, r^2 = 0.13
  const double u = 0.3, v = -0.2, r2 = 0.13;
  const auto expect = [&](const Camera& camera, double px, double py) {
    SCOPED_TRACE(NameOf(camera));
    const auto pixel = Project(camera, x);
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x(), px, 1e-9);
    EXPECT_NEAR(pixel->y(), py, 1e-9);
  };
  expect(MakeCamera("SIMPLE_PINHOLE", {100, 320, 240}), 350, 220);
  expect(MakeCamera("PINHOLE", {100, 200, 320, 240}), 350, 200);
  expect(MakeCamera("SIMPLE_RADIAL", {100, 320, 240, 0.1}), 320 + 30 * 1.013, 240 - 20 * 1.013);
  const double radial = 1 + 0.1 * r2 + 0.2 * r2 * r2;
  expect(MakeCamera("RADIAL", {100, 320, 240, 0.1, 0.2}), 320 + 30 * radial, 240 - 20 * radial);
  // k1 k2 p1 p2
  const double du = 2 * 0.01 * u * v + 0.02 * (r2 + 2 * u * u);
  const double dv = 2 * 0.02 * u * v + 0.01 * (r2 + 2 * v * v);
  expect(MakeCamera("OPENCV", {100, 200, 320, 240, 0.1, 0.2, 0.01, 0.02}),
         320 + 100 * (u * radial + du),
         240 + 200 * (v * radial + dv));
  // k1 k2 p1 p2 k3 k4 k5 k6
  const double rational = (1 + 0.1 * r2 + 0.2 * r2 * r2 + 0.3 * r2 * r2 * r2) /
                          (1 + 0.4 * r2 + 0.5 * r2 * r2 + 0.6 * r2 * r2 * r2);
  expect(MakeCamera("FULL_OPENCV", {100, 200, 320, 240, 0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6}),
         320 + 100 * (u * rational + du),
         240 + 200 * (v * rational + dv));
  const double r = std::sqrt(r2);
  const double fov = std::atan(2 * r * std::tan(0.45)) / 0.9 / r;
  expect(MakeCamera("FOV", {100, 200, 320, 240, 0.9}), 320 + 100 * u * fov, 240 + 200 * v * fov);
  const double theta = std::atan(r);
  const double a = u * theta / r, b = v * theta / r, t2 = theta * theta;
  expect(MakeCamera("SIMPLE_RADIAL_FISHEYE", {100, 320, 240, 0.1}),
         320 + 100 * a * (1 + 0.1 * t2),
         240 + 100 * b * (1 + 0.1 * t2));
  expect(MakeCamera("RADIAL_FISHEYE", {100, 320, 240, 0.1, 0.2}),
         320 + 100 * a * (1 + 0.1 * t2 + 0.2 * t2 * t2),
         240 + 100 * b * (1 + 0.1 * t2 + 0.2 * t2 * t2));
  const double fisheye =
      1 + 0.1 * t2 + 0.2 * t2 * t2 + 0.3 * t2 * t2 * t2 + 0.4 * t2 * t2 * t2 * t2;
  expect(MakeCamera("OPENCV_FISHEYE", {100, 200, 320, 240, 0.1, 0.2, 0.3, 0.4}),
         320 + 100 * a * fisheye,
         240 + 200 * b * fisheye);
  // k1 k2 p1 p2 k3 k4 sx1 sy1
  expect(MakeCamera("THIN_PRISM_FISHEYE",
                    {100, 200, 320, 240, 0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.05, 0.06}),
         320 + 100 * (a * fisheye + 2 * 0.01 * a * b + 0.02 * (t2 + 2 * a * a) + 0.05 * t2),
         240 + 200 * (b * fisheye + 2 * 0.02 * a * b + 0.01 * (t2 + 2 * b * b) + 0.06 * t2));
  expect(MakeCamera("SIMPLE_FISHEYE", {100, 320, 240}), 320 + 100 * a, 240 + 100 * b);
  expect(MakeCamera("FISHEYE", {100, 200, 320, 240}), 320 + 100 * a, 240 + 200 * b);
  // k0 .. k5 p0 p1 s0 .. s3, the last six of the point that the first six have moved
  const double t4 = t2 * t2;
  const double bent = fisheye + 0.5 * t4 * t4 * t2 + 0.6 * t4 * t4 * t4;
  const double p = a * bent, q = b * bent, s2 = p * p + q * q;
  expect(
      MakeCamera(
          "RAD_TAN_THIN_PRISM_FISHEYE",
          {100, 200, 320, 240, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06}),
      320 + 100 * (p + 2 * 0.02 * p * q + 0.01 * (s2 + 2 * p * p) + 0.03 * s2 + 0.04 * s2 * s2),
      240 + 200 * (q + 2 * 0.01 * p * q + 0.02 * (s2 + 2 * q * q) + 0.05 * s2 + 0.06 * s2 * s2));
  // r = d / (1 + k d^2), solved for d
  const double division = (1 - std::sqrt(1 + 4 * 0.1 * r2)) / (-2 * 0.1 * r2);
  expect(MakeCamera("SIMPLE_DIVISION", {100, 320, 240, -0.1}),
         320 + 100 * u * division,
         240 + 100 * v * division);
  expect(MakeCamera("DIVISION", {100, 200, 320, 240, -0.1}),
         320 + 100 * u * division,
         240 + 200 * v * division);
  const double eucm = 0.6 * std::sqrt(1.1 * r2 + 1) + 0.4;
  expect(MakeCamera("EUCM", {100, 200, 320, 240, 0.6, 1.1}),
         320 + 100 * u / eucm,
         240 + 200 * v / eucm);
  expect(MakeCamera("EQUIRECTANGULAR", {640, 480}),
         320 + 640 * std::atan(0.3) / (2 * std::numbers::pi),
         240 + 480 * std::atan2(-0.4, std::hypot(0.6, 2)) / std::numbers::pi);
}

TEST(CameraModels, FisheyeSeesBeyondNinetyDegrees) {
  const double focal = 100;
  for (const Camera& camera :
       {MakeCamera("OPENCV_FISHEYE", {focal, focal, 320, 240, 0, 0, 0, 0}),
        MakeCamera("SIMPLE_RADIAL_FISHEYE", {focal, 320, 240, 0.01}),
        MakeCamera("RADIAL_FISHEYE", {focal, 320, 240, 0.01, 0.001}),
        MakeCamera("THIN_PRISM_FISHEYE",
                   {focal, focal, 320, 240, 0.01, 0, 1e-4, 1e-4, 0, 0, 1e-4, 0})}) {
    SCOPED_TRACE(NameOf(camera));
    const double theta = 110 * std::numbers::pi / 180;
    const Vector3d behind(0.6 * std::sin(theta), 0.8 * std::sin(theta), std::cos(theta));
    const auto pixel = Project(camera, behind);
    ASSERT_TRUE(pixel);
    const auto ray = Unproject(camera, *pixel);
    ASSERT_TRUE(ray);
    EXPECT_LT(ray->z(), 0);
    EXPECT_LT((*ray - behind).norm(), 1e-10);
  }
  // Angles beyond 180 degrees are no directions.
  const Camera wide = MakeCamera("OPENCV_FISHEYE", {100, 100, 320, 240, 0, 0, 0, 0});
  EXPECT_TRUE(Unproject(wide, {320 + 313, 240}));
  EXPECT_FALSE(Unproject(wide, {320 + 315, 240}));
}

TEST(CameraModels, NothingBehindAPerspectiveCameraIsSeen) {
  const Camera camera = MakeCamera("OPENCV", {500, 500, 320, 240, 0, 0, 0, 0});
  EXPECT_FALSE(Project(camera, {0.1, 0.1, -1}));
  EXPECT_FALSE(Project(camera, {0.1, 0.1, 0}));
  EXPECT_FALSE(Project(camera, {NAN, 0.1, 1}));
}

TEST(CameraModels, PixelsBeyondTheFoldHaveNoRay) {
  // r (1 - r^2 / 3) grows up to r = 1 only, where it is 2 / 3.
  const Camera camera = MakeCamera("SIMPLE_RADIAL", {300, 320, 240, -1.0 / 3});
  const auto inside = Unproject(camera, {320 + 300 * 0.66, 240});
  ASSERT_TRUE(inside);
  const double r = inside->x() / inside->z();
  EXPECT_LT(r, 1);
  EXPECT_NEAR(r * (1 - r * r / 3), 0.66, 1e-12);
  EXPECT_FALSE(Unproject(camera, {320 + 300 * 0.67, 240}));
  EXPECT_FALSE(Unproject(camera, {320 + 300 * 5.0, 240}));
  // The polynomial folds back and comes forth again: what lies behind the fold is no ray either.
  const Camera wavy = MakeCamera("RADIAL", {300, 320, 240, -1.0 / 3, 0.04});
  for (double distorted = 0; distorted < 3; distorted += 0.01) {
    const auto ray = Unproject(wavy, {320 + 300 * distorted, 240});
    if (ray) {
      const double radius = ray->x() / ray->z();
      EXPECT_LT(radius, 1.2) << distorted;
      EXPECT_GE(radius, 0) << distorted;
    }
  }
}

// The direction at the radius r of a lens's own plane: theta for fisheyes, tan(theta) for others.
Vector3d DirectionAt(const Camera& camera, double r, double angle) {
  const bool fisheye = NameOf(camera).find("FISHEYE") != std::string::npos;
  const double theta = fisheye ? r : std::atan(r);
  return {std::sin(theta) * std::cos(angle), std::sin(theta) * std::sin(angle), std::cos(theta)};
}

// Where, going outwards, the picture of the lens begins to run back or to turn over; `reach` where
// it never does. By differences of Project alone.
double FoldOf(const Camera& camera, double angle, double reach) {
  constexpr double kStep = 1e-3;
  const auto pixel = [&](double r, double a) {
    return *Project(camera, DirectionAt(camera, r, a));
  };
  for (double r = kStep; r < reach; r += kStep) {
    const Vector2d outwards = pixel(r + kStep / 8, angle) - pixel(r - kStep / 8, angle);
    const Vector2d around = pixel(r, angle + kStep / 8) - pixel(r, angle - kStep / 8);
    if (outwards.x() * around.y() - outwards.y() * around.x() <= 0) return r;
  }
  return reach;
}

// Neither too many pixels nor too few have a ray: what lies before the fold is found again, what
// lies behind it never is.
TEST(CameraModels, RaysAreThoseBeforeTheFold) {
  constexpr double kReach = 1.5;
  int folds = 0;
  int behind = 0;
  std::vector<Camera> cameras = RealisticCameras();
  for (const Camera& camera : WildCameras()) cameras.push_back(camera);
  cameras.push_back(LaterCameras()[0]);
  cameras.push_back(MakeCamera(
      "RAD_TAN_THIN_PRISM_FISHEYE",
      {230, 231, 318, 242, -0.3, 0.05, 0.02, -0.01, 0, 0, 0.02, -0.03, 0.03, 0.01, -0.02, 0.01}));
  for (const Camera& camera : cameras) {
    SCOPED_TRACE(NameOf(camera) + " " + testing::PrintToString(camera.params));
    for (int k = 0; k < 24; ++k) {
      const double angle = 0.1 + k * std::numbers::pi / 12;
      const double fold = FoldOf(camera, angle, kReach);
      folds += fold < kReach;
      for (double r = 0.01; r < kReach; r += 0.01) {
        const Vector3d direction = DirectionAt(camera, r, angle);
        const auto ray = Unproject(camera, *Project(camera, direction));
        if (r < 0.97 * fold) {
          ASSERT_TRUE(ray) << r << " " << angle << " " << fold;
          EXPECT_LT((*ray - direction).norm(), 1e-6) << r << " " << angle << " " << fold;
        } else if (r > 1.03 * fold) {
          ++behind;
          EXPECT_FALSE(ray && (*ray - direction).norm() < 1e-3) << r << " " << angle << " " << fold;
        }
      }
    }
  }
  EXPECT_GT(folds, 100);
  EXPECT_GT(behind, 1000);
}

TEST(CameraModels, WildParametersGiveNoRayRatherThanANonsenseOne) {
  const Camera camera =
      MakeCamera("FULL_OPENCV", {300, 300, 320, 240, 1e8, -1e8, 3, 4, 1e9, -5, 6, -7});
  for (double x = 0; x < 640; x += 7) {
    const auto ray = Unproject(camera, {x, 100});
    if (!ray) continue;
    EXPECT_TRUE(ray->allFinite());
    const auto pixel = Project(camera, *ray);
    ASSERT_TRUE(pixel);
    EXPECT_NEAR(pixel->x(), x, 1e-5);
  }
}

TEST(CameraModels, RescalingFollowsColmapsRule) {
  const Camera one = MakeCamera("SIMPLE_RADIAL", {500, 320, 240, 0.1});
  const Camera half = RescaledCamera(one, 320, 120);  // sx = 1/2, sy = 1/4
  EXPECT_EQ(half.width, 320u);
  EXPECT_EQ(half.height, 120u);
  EXPECT_THAT(half.params, testing::ElementsAre(500 * 0.375, 160, 60, 0.1));
  const Camera two = MakeCamera("OPENCV", {500, 510, 320, 240, 1, 2, 3, 4});
  EXPECT_THAT(RescaledCamera(two, 320, 120).params,
              testing::ElementsAre(250, 127.5, 160, 60, 1, 2, 3, 4));
  // At the same aspect, pixels of the small photo see what those of the large one see.
  for (const Camera& camera : AllRealisticCameras()) {
    const Camera small = RescaledCamera(camera, 160, 120);
    const auto ray = Unproject(camera, {4 * 30.5, 4 * 20.5});
    const auto same = Unproject(small, {30.5, 20.5});
    ASSERT_TRUE(ray && same);
    EXPECT_LT((*ray - *same).norm(), 1e-9) << NameOf(camera);
  }
}

TEST(CameraModels, DistortionIsMeasuredAtTheCorners) {
  EXPECT_EQ(DistortionAtCorners(MakeCamera("PINHOLE", {533.3, 540.1, 318.2, 243.7})), 0);
  EXPECT_EQ(DistortionAtCorners(MakeCamera("SIMPLE_RADIAL", {533.3, 320, 240, 0})), 0);
  // A corner is 400 pixels off the axis: u (1 - 0.08 u^2) = 400 / f, and it is f u without.
  const Camera camera = MakeCamera("SIMPLE_RADIAL", {533.3, 320, 240, -0.08});
  const double u = (400 + DistortionAtCorners(camera)) / 533.3;
  EXPECT_NEAR(u * (1 - 0.08 * u * u), 400 / 533.3, 1e-9);
  EXPECT_GT(u, 400 / 533.3);
  // No pinhole camera sees sideways.
  EXPECT_EQ(DistortionAtCorners(MakeCamera("SIMPLE_RADIAL_FISHEYE", {230, 320, 240, 0.03})),
            std::numeric_limits<double>::infinity());
  const Camera pinhole = WithoutDistortion(camera);
  EXPECT_EQ(NameOf(pinhole), "PINHOLE");
  EXPECT_EQ(pinhole.params, (std::vector<double>{533.3, 533.3, 320, 240}));
  EXPECT_EQ(pinhole.width, camera.width);
}

// Models that COLMAP 3.8, which judges the others, does not know yet, are what they generalise
// where their own parameters say nothing.
TEST(CameraModels, LaterModelsContainTheEarlierOnes) {
  const std::vector<std::pair<Camera, Camera>> same = {
      {MakeCamera("SIMPLE_FISHEYE", {250, 320, 240}),
       MakeCamera("OPENCV_FISHEYE", {250, 250, 320, 240, 0, 0, 0, 0})},
      {MakeCamera("FISHEYE", {250, 260, 320, 240}),
       MakeCamera("OPENCV_FISHEYE", {250, 260, 320, 240, 0, 0, 0, 0})},
      {MakeCamera("RAD_TAN_THIN_PRISM_FISHEYE",
                  {250, 260, 320, 240, 0.05, -0.012, 0.004, -9e-4, 0, 0, 0, 0, 0, 0, 0, 0}),
       MakeCamera("OPENCV_FISHEYE", {250, 260, 320, 240, 0.05, -0.012, 0.004, -9e-4})},
      {MakeCamera("SIMPLE_DIVISION", {500, 320, 240, 0}),
       MakeCamera("SIMPLE_PINHOLE", {500, 320, 240})},
      {MakeCamera("DIVISION", {500, 510, 320, 240, 0}),
       MakeCamera("PINHOLE", {500, 510, 320, 240})},
      {MakeCamera("EUCM", {500, 510, 320, 240, 0, 1}), MakeCamera("PINHOLE", {500, 510, 320, 240})},
  };
  for (const auto& [later, earlier] : same) {
    SCOPED_TRACE(NameOf(later));
    for (double y = 0; y <= 480; y += 24) {
      for (double x = 0; x <= 640; x += 32) {
        const auto ray = Unproject(later, {x, y});
        const auto expected = Unproject(earlier, {x, y});
        ASSERT_TRUE(ray && expected);
        EXPECT_LT((*ray - *expected).norm(), 1e-12) << x << " " << y;
        EXPECT_LT((*Project(earlier, *ray) - Vector2d(x, y)).norm(), 1e-9) << x << " " << y;
      }
    }
  }
}

TEST(CameraModels, DivisionEndsWhereItFolds) {
  // r / (1 + 0.25 r^2) grows up to r = 2, where it is 1.
  const Camera camera = MakeCamera("SIMPLE_DIVISION", {100, 320, 240, 0.25});
  const auto ray = Unproject(camera, {320 + 199, 240});
  ASSERT_TRUE(ray);
  EXPECT_NEAR(ray->x() / ray->z(), 1.99 / (1 + 0.25 * 1.99 * 1.99), 1e-12);
  EXPECT_FALSE(Unproject(camera, {320 + 201, 240}));
  EXPECT_TRUE(Project(camera, {0.99, 0, 1}));
  EXPECT_FALSE(Project(camera, {1.01, 0, 1}));
  // Of the other sign it sees more than the half of everything.
  const Camera wide = MakeCamera("DIVISION", {100, 100, 320, 240, -0.25});
  const auto behind = Unproject(wide, {320 + 210, 240});
  ASSERT_TRUE(behind);
  EXPECT_LT(behind->z(), 0);
  EXPECT_NEAR(Project(wide, *behind)->x(), 320 + 210, 1e-9);
}

TEST(CameraModels, EquirectangularSeesEverything) {
  const Camera camera = MakeCamera("EQUIRECTANGULAR", {640, 480});
  EXPECT_LT((*Unproject(camera, {320, 240}) - Vector3d(0, 0, 1)).norm(), 1e-12);
  EXPECT_LT((*Unproject(camera, {480, 240}) - Vector3d(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT((*Unproject(camera, {320, 480}) - Vector3d(0, 1, 0)).norm(), 1e-12);
  EXPECT_LT((*Unproject(camera, {640, 240}) - Vector3d(0, 0, -1)).norm(), 1e-12);
  EXPECT_FALSE(Unproject(camera, {641, 240}));
  EXPECT_FALSE(Unproject(camera, {320, -1}));
  EXPECT_FALSE(Project(camera, {0, 0, 0}));
  EXPECT_TRUE(IsDistorted(camera));
  EXPECT_THAT(RescaledCamera(camera, 320, 120).params, testing::ElementsAre(320, 120));
}

TEST(CameraModels, WhatMustBePositive) {
  EXPECT_TRUE(MustBePositive(*FindCameraModel("OPENCV"), 1));
  EXPECT_FALSE(MustBePositive(*FindCameraModel("OPENCV"), 2));
  EXPECT_FALSE(MustBePositive(*FindCameraModel("SIMPLE_RADIAL"), 1));
  EXPECT_TRUE(MustBePositive(*FindCameraModel("EQUIRECTANGULAR"), 1));
}

}  // namespace
}  // namespace semfoam
