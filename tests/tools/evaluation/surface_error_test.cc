// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/surface_error.h"

#include <cmath>

#include "tests/export/test_foams.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// Rays from above the two balls, over a grid.
DepthView FromAbove() {
  DepthView view{{0, 0, 3}, {}, {}};
  for (double x = -0.8; x < 0.81; x += 0.05) {
    for (double y = -0.4; y < 0.41; y += 0.05) {
      const Eigen::Vector3d offset = Eigen::Vector3d(x, y, 0) - view.origin;
      view.directions.push_back(offset.normalized().cast<float>());
      view.distances.push_back(offset.norm());
    }
  }
  return view;
}

TEST(SurfaceError, TheFoamItsSurfacesAndItsVolumeAreMetAtTheSamePlace) {
  const Model model = TouchingBalls();
  const ViewRenderer renderer(model.foam);
  const ExportableScene scene = MakeExportableScene(model);
  const DepthView view = FromAbove();
  const std::vector<float> foam = FoamDistances(renderer, view);
  const std::vector<float> cells = CellSurfaceDistances(renderer, scene, view);
  int hits = 0, misses = 0;
  for (size_t i = 0; i < foam.size(); ++i) {
    // All matter belongs to an object, and is opaque where it begins.
    EXPECT_NEAR(foam[i], cells[i], 1e-3) << i;
    (foam[i] > 0 ? hits : misses) += 1;
  }
  EXPECT_GT(hits, 50);
  EXPECT_GT(misses, 50);

  // The volume is off by about a voxel, where the ray meets it within the box.
  double coarse_error = 0, fine_error = 0;
  for (const int resolution : {24, 192}) {
    VolumeExportOptions options;
    options.max_resolution = resolution;
    const VolumeFrame frame = MakeVolumeFrame(scene, options);
    const std::vector<float> volume =
        VolumeDistances(scene, frame, options.min_optical_depth, view);
    std::vector<double> errors;
    for (size_t i = 0; i < foam.size(); ++i) {
      const Eigen::Vector3d met = view.origin + foam[i] * view.directions[i].cast<double>();
      if (foam[i] == 0 || volume[i] == 0 || !frame.box.contains(met)) continue;
      errors.push_back(std::abs(volume[i] - foam[i]));
    }
    ASSERT_GT(errors.size(), 50u);
    double mean = 0;
    for (const double error : errors) mean += error / static_cast<double>(errors.size());
    EXPECT_LT(mean, frame.lattice.voxel_size) << resolution;
    (resolution == 24 ? coarse_error : fine_error) = mean;
  }
  EXPECT_LT(fine_error, 0.5 * coarse_error);
}

TEST(SurfaceError, IsTheMedianAndCountsWhatMeetsNothing) {
  const DepthView view{{0, 0, 0}, std::vector<Eigen::Vector3f>(5, {0, 0, 1}), {1, 1, 1, 1, 1}};
  const auto error = [&](std::vector<float> distances) {
    return SurfaceError({view}, [&](const DepthView&) { return distances; });
  };
  EXPECT_NEAR(error({1.5f, 1.1f, 0.8f, 3, 1}), 0.2, 1e-6);
  EXPECT_NEAR(error({1.1f, 1.1f, 1.1f, 0, 0}), 0.1, 1e-6);
  EXPECT_EQ(error({1.1f, 1.1f, 0, 0, 0}), INFINITY);
  EXPECT_TRUE(std::isnan(SurfaceError({}, nullptr)));
}

TEST(SurfaceError, ProbesAreThePointsThatHeldOutPhotosSaw) {
  Reconstruction reconstruction;
  for (uint32_t id : {1u, 2u}) {
    Image image;
    image.id = id;
    image.name = id == 1 ? "held out.jpg" : "trained.jpg";
    image.cam_from_world.translation = {0, 0, 5};  // so that the centre is at z = -5
    reconstruction.images.push_back(image);
  }
  const auto add = [&](double z, std::vector<TrackElement> track) {
    Point3D point;
    point.position = {0, 0, z};
    point.track = std::move(track);
    reconstruction.points.push_back(point);
  };
  add(1, {{1, 0}, {2, 0}, {1, 3}});  // named twice, counted once
  add(2, {{2, 1}});
  add(INFINITY, {{1, 1}});
  std::vector<PhotoRecord> photos(2);
  photos[0].name = "held out.jpg";
  photos[0].held_out = true;
  photos[1].name = "trained.jpg";
  const Similarity frame{2, Eigen::Vector3d::Zero()};
  const std::vector<DepthView> views = MakeDepthViews(reconstruction, photos, frame);
  ASSERT_EQ(views.size(), 1u);
  EXPECT_NEAR(views[0].origin.z(), -2.5, 1e-12);
  ASSERT_EQ(views[0].distances.size(), 1u);
  EXPECT_NEAR(views[0].distances[0], 3, 1e-12);
  EXPECT_NEAR(views[0].directions[0].z(), 1, 1e-6);

  const Eigen::AlignedBox3d beside(Eigen::Vector3d(1, 1, 0), Eigen::Vector3d(2, 2, 1));
  EXPECT_TRUE(Within(views, beside).empty());
  const Eigen::AlignedBox3d around(Eigen::Vector3d(-1, -1, 0), Eigen::Vector3d(2, 2, 1));
  EXPECT_EQ(Within(views, around).size(), 1u);
}

}  // namespace
}  // namespace semfoam
