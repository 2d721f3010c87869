// SPDX-License-Identifier: GPL-3.0-or-later
//
// Our rays against COLMAP's own projection. `colmap point_filtering` projects every point into the
// images of its track anew and stores the mean distance to the observations, in full precision. So
// points are put on our rays, observed at the rays' pixels: what it stores is how far COLMAP would
// see them from there.
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/colmap_model.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "tests/plugin/colmap/colmap_program.h"
#include "tests/plugin/colmap/lenses.h"
#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kShift = 0.5;  // pixels by which the observations of the control points are wrong

// A model of points on the rays of some cameras, each camera in two images.
class RayModel {
 public:
  // Pixels of a grid that ends at the image's borders, and random ones. Returns how many have rays
  // in front of the camera: COLMAP 3.8 sees nothing else.
  int AddCamera(Camera camera) {
    camera.id = static_cast<uint32_t>(model_.cameras.size() + 1);
    model_.cameras.push_back(camera);
    Image a;
    a.id = 2 * camera.id;
    a.camera_id = camera.id;
    a.name = std::to_string(a.id) + ".png";
    a.cam_from_world.rotation = Eigen::Quaterniond(UniformVector<4>());
    a.cam_from_world.rotation.normalize();
    a.cam_from_world.translation = 3 * UniformVector<3>();
    Image b = a;
    b.id = 2 * camera.id + 1;
    b.name = std::to_string(b.id) + ".png";
    b.cam_from_world.translation += 0.05 * UniformVector<3>();

    const auto width = static_cast<double>(camera.width);
    const auto height = static_cast<double>(camera.height);
    std::vector<Vector2d> pixels;
    constexpr int kGrid = 24;
    for (int i = 0; i <= kGrid; ++i) {
      for (int j = 0; j <= kGrid; ++j) pixels.emplace_back(width * i / kGrid, height * j / kGrid);
    }
    for (int i = 0; i < 400; ++i) {
      const Vector2d part = (UniformVector<2>().array() + 1) / 2;
      pixels.emplace_back(width * part.x(), height * part.y());
    }
    int rays = 0;
    for (const Vector2d& pixel : pixels) {
      const auto ray = Unproject(camera, pixel);
      if (!ray || ray->z() < 0.01) continue;
      const Vector3d x_cam = std::exp(2 * UniformVector<1>()[0]) * *ray;
      const Vector3d x_world =
          a.cam_from_world.UnitRotation().conjugate() * (x_cam - a.cam_from_world.translation);
      const Vector3d x_b = b.cam_from_world.UnitRotation() * x_world + b.cam_from_world.translation;
      const auto second = Project(camera, x_b);
      if (x_b.z() < 0.01 || !second) continue;
      AddPoint(x_world, pixel, *second, &a, &b);
      ++rays;
    }
    model_.images.push_back(a);
    model_.images.push_back(b);
    return rays;
  }

  // The largest distance, over the points of each camera, between our pixel and COLMAP's.
  std::map<uint32_t, double> LargestErrors() const {
    const TempFolder temp;
    WriteReconstruction(temp / "model", model_, ModelFormat::kBinary);
    RunColmap(temp,
              "point_filtering",
              temp / "model",
              temp / "out",
              "--max_reproj_error 100000 --min_tri_angle 0 --min_track_len 2");
    const Reconstruction judged = ReadReconstruction(temp / "out");
    EXPECT_EQ(judged.points.size(), model_.points.size());
    std::map<uint32_t, double> largest;
    for (const Point3D& point : judged.points) {
      // COLMAP stores the mean of two distances: neither can be larger than their sum.
      const double expected = IsControl(point.id) ? kShift : 0;
      double& error = largest[point.track[0].image_id / 2];
      error = std::max(error, std::abs(2 * point.error - expected));
    }
    return largest;
  }

 private:
  // In [-1, 1)^size.
  template <int kSize>
  Eigen::Matrix<double, kSize, 1> UniformVector() {
    Eigen::Matrix<double, kSize, 1> x;
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < kSize; ++i) x[i] = uniform(random_);
    return x;
  }

  // Every tenth observation is wrong on purpose: COLMAP must say by how much, or it says nothing.
  static bool IsControl(uint64_t point_id) { return point_id % 10 == 7; }

  void AddPoint(
      const Vector3d& x_world, const Vector2d& in_a, const Vector2d& in_b, Image* a, Image* b) {
    Point3D point;
    point.id = model_.points.size() + 1;
    point.position = x_world;
    point.error = 1000;  // what nobody computed
    point.track = {{a->id, static_cast<uint32_t>(a->points.size())},
                   {b->id, static_cast<uint32_t>(b->points.size())}};
    a->points.push_back({in_a.x() + (IsControl(point.id) ? kShift : 0), in_a.y(), point.id});
    b->points.push_back({in_b.x(), in_b.y(), point.id});
    model_.points.push_back(point);
  }

  Reconstruction model_;
  std::mt19937 random_{5};
};

TEST(ColmapProjection, SeesOurRaysAtTheirPixels) {
  RayModel model;
  std::vector<std::string> names;
  for (const Camera& camera : RealisticCameras()) {
    EXPECT_GT(model.AddCamera(camera), 950) << NameOf(camera);
    names.push_back(NameOf(camera));
  }
  const std::map<uint32_t, double> errors = model.LargestErrors();
  ASSERT_EQ(errors.size(), names.size());
  for (const auto& [id, error] : errors) {
    EXPECT_LT(error, 1e-6) << names[id - 1];
  }
}

// Where a lens folds within the image, some pixels have no ray; those that have one are right.
TEST(ColmapProjection, SeesTheRaysOfWildLensesAtTheirPixels) {
  RayModel model;
  std::vector<std::string> names;
  for (const Camera& camera : WildCameras()) {
    const int rays = model.AddCamera(camera);
    EXPECT_GT(rays, 100) << NameOf(camera);
    names.push_back(NameOf(camera) + " (" + std::to_string(rays) + " rays)");
  }
  const std::map<uint32_t, double> errors = model.LargestErrors();
  ASSERT_EQ(errors.size(), names.size());
  for (const auto& [id, error] : errors) {
    EXPECT_LT(error, 1e-6) << names[id - 1];
  }
}

}  // namespace
}  // namespace semfoam
