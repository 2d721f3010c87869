// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/edit/model_transform.h"

#include "tests/foam/edit/object_scenes.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

const Sim3 kTransform = {
    3,
    Eigen::AngleAxisd(1.1, Eigen::Vector3d(2, 1, -1).normalized()).toRotationMatrix(),
    {1e5, -20, 7}};

// A model with a photo, in a frame of its own.
Model SomeModel(int sh_degree) {
  Model model = RingTableBallModel(sh_degree);
  model.world_from_normalized = {0.5, {10, 20, 30}};
  model.foam.assumed_density.assign(model.foam.NumSites(), 0.f);
  for (size_t i = 0; i < model.foam.NumSites(); i += 50) model.foam.assumed_density[i] = 5;
  PhotoRecord photo;
  photo.name = "a.jpg";
  photo.cam_from_world_rotation = Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 1, 0).normalized());
  photo.cam_from_world_translation = {1, 2, 3};
  model.photos = {photo};
  return model;
}

Eigen::Vector3d InCamera(const PhotoRecord& photo, const Eigen::Vector3d& x_world) {
  return photo.cam_from_world_rotation * x_world + photo.cam_from_world_translation;
}

// The view after the model was turned.
CameraRays Turned(CameraRays rays) {
  rays.origin = kTransform.rotation * rays.origin;
  for (Eigen::Vector3f& direction : rays.directions) {
    direction = (kTransform.rotation * direction.cast<double>()).cast<float>();
  }
  return rays;
}

TEST(ModelTransform, TurnedCamerasSeeTheSame) {
  for (int sh_degree = 0; sh_degree <= 3; ++sh_degree) {
    const Model model = SomeModel(sh_degree);
    Model turned = model;
    TransformModel(kTransform, &turned);
    for (const CameraRays& view : SomeViews()) {
      const RenderedView before = Render(model, view), after = Render(turned, Turned(view));
      double squares = 0;
      for (size_t i = 0; i < before.color.size(); ++i) {
        squares += (before.color[i] - after.color[i]).squaredNorm();
      }
      // 60 dB: positions are rounded to floats.
      EXPECT_LT(squares / (3.0 * static_cast<double>(before.color.size())), 1e-6) << sh_degree;
    }
  }
}

TEST(ModelTransform, ColoursThatDidNotTurnWouldShow) {
  const Model model = SomeModel(2);
  Model turned = model;
  TransformModel(kTransform, &turned);
  Model wrong = model;
  for (Eigen::Vector3f& x : wrong.foam.positions) {
    x = (kTransform.rotation * x.cast<double>()).cast<float>();
  }
  const CameraRays view = SomeViews()[0];
  EXPECT_GT(LargestDifference(Render(model, view), Render(wrong, Turned(view))), 0.05f);
  EXPECT_LT(LargestDifference(Render(model, view), Render(turned, Turned(view))), 0.05f);
}

TEST(ModelTransform, CellsAndCamerasMoveTogether) {
  const Model model = SomeModel(1);
  Model moved = model;
  TransformModel(kTransform, &moved);
  EXPECT_EQ(moved.world_from_normalized.scale, 1.5);
  const Eigen::Vector3d normalized(0.3, -0.2, 0.1);
  const Eigen::Vector3d before = model.world_from_normalized.Apply(normalized);
  const Eigen::Vector3d after = moved.world_from_normalized.Apply(kTransform.rotation * normalized);
  EXPECT_LT((kTransform.Apply(before) - after).norm(), 1e-9);
  EXPECT_LT((3 * InCamera(model.photos[0], before) - InCamera(moved.photos[0], after)).norm(),
            1e-9);
}

TEST(ModelTransform, WithoutATurnNoCellChanges) {
  const Model model = SomeModel(2);
  Model moved = model;
  TransformModel({2, Eigen::Matrix3d::Identity(), {1, 2, 3}}, &moved);
  EXPECT_EQ(moved.foam.positions, model.foam.positions);
  EXPECT_EQ(moved.foam.sh, model.foam.sh);
  EXPECT_EQ(moved.photos[0].cam_from_world_rotation.coeffs(),
            model.photos[0].cam_from_world_rotation.coeffs());
  EXPECT_EQ(moved.world_from_normalized.scale, 1);
  Model same = model;
  TransformModel({}, &same);
  EXPECT_EQ(same.world_from_normalized.translation, model.world_from_normalized.translation);
  EXPECT_EQ(same.photos[0].cam_from_world_translation, model.photos[0].cam_from_world_translation);
}

}  // namespace
}  // namespace semfoam
