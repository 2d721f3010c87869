// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/camera_models.h"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace semfoam {

inline Camera MakeCamera(std::string_view model, std::vector<double> params, int width = 640) {
  Camera camera;
  camera.id = 7;
  camera.model_id = FindCameraModel(model)->id;
  camera.width = width;
  camera.height = width * 3 / 4;
  camera.params = std::move(params);
  return camera;
}

inline std::string NameOf(const Camera& camera) {
  return std::string(FindCameraModel(camera.model_id)->name);
}

// Lenses as calibrations find them: every pixel of the image has a ray.
inline std::vector<Camera> RealisticCameras() {
  return {
      MakeCamera("SIMPLE_PINHOLE", {533.3, 320, 240}),
      MakeCamera("PINHOLE", {533.3, 540.1, 318.2, 243.7}),
      MakeCamera("SIMPLE_RADIAL", {533.3, 320, 240, -0.08}),
      MakeCamera("SIMPLE_RADIAL", {533.3, 320, 240, 0.12}),
      MakeCamera("RADIAL", {533.3, 320, 240, -0.24, 0.09}),
      MakeCamera("OPENCV", {533.3, 540.1, 318.2, 243.7, -0.28, 0.11, 8e-4, -1.3e-3}),
      MakeCamera("OPENCV_FISHEYE", {250, 251, 320, 240, 0.05, -0.012, 0.004, -9e-4}),
      MakeCamera("FULL_OPENCV",
                 {533.3, 540.1, 318.2, 243.7, 0.3, 0.1, 5e-4, -7e-4, 0.02, 0.55, 0.15, 0.01}),
      MakeCamera("FOV", {320, 322, 320, 240, 0.92}),
      MakeCamera("FOV", {533, 533, 320, 240, 1e-7}),
      MakeCamera("SIMPLE_RADIAL_FISHEYE", {230, 320, 240, 0.03}),
      MakeCamera("RADIAL_FISHEYE", {230, 320, 240, 0.04, -0.008}),
      MakeCamera("THIN_PRISM_FISHEYE",
                 {230, 231, 318, 242, 0.03, -0.006, 4e-4, -6e-4, 1e-3, -1e-4, 8e-4, -5e-4}),
  };
}

// The same for the models that came after COLMAP 3.8.
inline std::vector<Camera> LaterCameras() {
  return {
      MakeCamera("RAD_TAN_THIN_PRISM_FISHEYE",
                 {230,
                  231,
                  318,
                  242,
                  0.03,
                  -0.006,
                  1e-3,
                  -1e-4,
                  2e-5,
                  -1e-5,
                  4e-4,
                  -6e-4,
                  8e-4,
                  -1e-4,
                  -5e-4,
                  1e-4}),
      MakeCamera("SIMPLE_DIVISION", {533.3, 320, 240, -0.2}),
      MakeCamera("DIVISION", {533.3, 540.1, 318.2, 243.7, 0.1}),
      MakeCamera("SIMPLE_FISHEYE", {230, 320, 240}),
      MakeCamera("FISHEYE", {230, 231, 318, 242}),
      MakeCamera("EUCM", {300, 301, 318, 242, 0.62, 1.07}),
      MakeCamera("EQUIRECTANGULAR", {640, 480}),
  };
}

// Lenses that bend light far more than glass does, or calibrations that went wrong at the borders:
// most of them fold back within the image, so that some of its pixels are nothing that they see.
inline std::vector<Camera> WildCameras() {
  return {
      MakeCamera("SIMPLE_RADIAL", {300, 320, 240, -0.25}),
      MakeCamera("SIMPLE_RADIAL", {300, 320, 240, 1.5}),
      MakeCamera("RADIAL", {300, 320, 240, -0.4, 0.05}),
      MakeCamera("OPENCV", {300, 310, 300, 250, -0.3, -0.05, 0.02, -0.03}),
      MakeCamera("OPENCV", {300, 310, 300, 250, 0.8, 0.3, -0.05, 0.04}),
      MakeCamera("OPENCV", {400, 410, 300, 250, -0.9, 0.6, 0.01, 0.01}),
      MakeCamera("OPENCV_FISHEYE", {150, 151, 320, 240, 0.3, -0.2, 0.05, -0.01}),
      MakeCamera("OPENCV_FISHEYE", {220, 221, 320, 240, -0.2, -0.05, -0.02, -0.01}),
      MakeCamera("FULL_OPENCV", {300, 310, 300, 250, -1, 0.4, 0.01, -0.02, -0.1, -0.5, 0.2, 0.1}),
      MakeCamera("FULL_OPENCV", {300, 310, 300, 250, 3, 2, 0.01, 0.02, 0.5, 4, 1, 0.2}),
      MakeCamera("FOV", {320, 322, 320, 240, 1.8}),
      MakeCamera("SIMPLE_RADIAL_FISHEYE", {230, 320, 240, -0.3}),
      MakeCamera("RADIAL_FISHEYE", {230, 320, 240, 0.6, -0.5}),
      MakeCamera("THIN_PRISM_FISHEYE",
                 {230, 231, 318, 242, -0.3, 0.05, 0.02, -0.03, 0.01, -0.02, 0.03, -0.02}),
  };
}

}  // namespace semfoam
