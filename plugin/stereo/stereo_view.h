// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/training_scene.h"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Photos reduced for dense matching, without their distortion.

// Number of pixels that a photo is reduced to: 320 x 240, or another shape of that area.
inline constexpr int kStereoPixels = 320 * 240;

// A reduced photo as a pinhole camera sees it, which has the focal lengths and the principal point
// of the photo's camera, scaled. Pixels as in Camera: the centre of the first is (0.5, 0.5).
struct StereoView {
  // Index of the photo in the scene.
  int view = 0;
  int width = 0;
  int height = 0;
  // In pixels of this view.
  Eigen::Vector2d focal = Eigen::Vector2d::Ones();
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  // Camera centre in the normalised frame, and rotation.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Matrix3d cam_from_world = Eigen::Matrix3d::Identity();
  // [height][width] Mean luma of display values (sRGB / 255) less 0.5; NaN where the photo shows
  // nothing (corners of distorted photos).
  std::vector<float> grey;
  // [height][width] Mean display values in the reference exposure (TrainingScene::SetLights), or as
  // they are where that is not known.
  std::vector<Eigen::Vector3f> color;

  size_t NumPixels() const { return grey.size(); }
  // Returns the centre of the pixel of this index.
  Eigen::Vector2d CenterOf(size_t index) const {
    return {static_cast<double>(index % width) + 0.5, static_cast<double>(index / width) + 0.5};
  }
  // Returns the point of the normalised frame that is seen at a pixel, at `depth` along z.
  Eigen::Vector3d PointAt(const Eigen::Vector2d& pixel, double depth) const;
  // Returns the direction in the normalised frame that a pixel looks in, of depth 1 along z.
  Eigen::Vector3d RayThrough(const Eigen::Vector2d& pixel) const {
    return PointAt(pixel, 1) - origin;
  }
  // Computes pixel and depth along z of a point of the normalised frame. Returns false where it
  // lies behind the camera.
  bool Project(const Eigen::Vector3d& point, Eigen::Vector2d* pixel, double* depth) const;
  // Returns whether the pixel lies in the image.
  bool Contains(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < width && pixel.y() < height;
  }
};

// Reduces a photo to kStereoPixels, or keeps its size where it has no more: each pixel is the mean
// over its area in the photo, of display values, in which the noise of cameras is about the same in
// dark and bright places. Takes at most 6 x 6 samples of that area. Reads the photo again where the
// scene does not hold its pixels; throws as TrainingScene::OpenView does.
StereoView MakeStereoView(const TrainingScene& scene, int view);

}  // namespace semfoam
