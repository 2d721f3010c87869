// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/stereo_view.h"

#include "plugin/colmap/camera_models.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

namespace semfoam {
namespace {

// Along each edge of a reduced pixel.
constexpr int kMostSamples = 6;

// Adds the display values (0..255) between pixel centres to `sum`. Returns false outside the photo.
bool AddInterpolated(const ViewPixels& pixels,
                     int width,
                     int height,
                     const Eigen::Vector2d& at,
                     Eigen::Vector3d* sum) {
  if (!(at.x() >= 0 && at.y() >= 0 && at.x() <= width && at.y() <= height)) return false;
  const double x = std::clamp(at.x() - 0.5, 0.0, width - 1.0);
  const double y = std::clamp(at.y() - 0.5, 0.0, height - 1.0);
  const int left = std::min(static_cast<int>(x), std::max(0, width - 2));
  const int top = std::min(static_cast<int>(y), std::max(0, height - 2));
  const double u = x - left, v = y - top;
  const auto add = [&](int px, int py, double weight) {
    if (weight == 0) return;
    const PixelValue value = pixels.At(px, py);
    for (int c = 0; c < 3; ++c) (*sum)[c] += weight * value.color[c];
  };
  add(left, top, (1 - u) * (1 - v));
  add(left + 1, top, u * (1 - v));
  add(left, top + 1, (1 - u) * v);
  add(left + 1, top + 1, u * v);
  return true;
}

// Returns the mean display values (0..255) in the reference exposure.
Eigen::Vector3f ReferenceColorOf(const TrainingScene& scene,
                                 int view,
                                 const Eigen::Vector2d& photo_pixel,
                                 const Eigen::Vector3d& mean) {
  PixelValue value;
  for (int c = 0; c < 3; ++c) value.color[c] = static_cast<uint8_t>(std::lround(mean[c]));
  value.SetClass(kUnlabelled);
  const int x = std::clamp(static_cast<int>(photo_pixel.x()), 0, scene.Width(view) - 1);
  const int y = std::clamp(static_cast<int>(photo_pixel.y()), 0, scene.Height(view) - 1);
  TrainingRay ray;
  if (scene.RayOf(view, x, y, value, &ray) && ray.at_least == 0 && ray.color.allFinite()) {
    return ray.color;
  }
  return mean.cast<float>() / 255.f;
}

}  // namespace

Eigen::Vector3d StereoView::PointAt(const Eigen::Vector2d& pixel, double depth) const {
  const Eigen::Vector2d plane = (pixel - center).cwiseQuotient(focal);
  return origin + cam_from_world.transpose() * (depth * plane.homogeneous());
}

bool StereoView::Project(const Eigen::Vector3d& point,
                         Eigen::Vector2d* pixel,
                         double* depth) const {
  const Eigen::Vector3d x_cam = cam_from_world * (point - origin);
  if (!(x_cam.z() > 0)) return false;
  *depth = x_cam.z();
  *pixel = focal.cwiseProduct(x_cam.hnormalized()) + center;
  return true;
}

StereoView MakeStereoView(const TrainingScene& scene, int view) {
  const PhotoRecord& photo = scene.Photos()[view];
  const Camera camera = CameraOf(photo, "the scene");
  const Camera pinhole = WithoutDistortion(camera);
  const double area = double(photo.width) * photo.height;
  const double reduction = std::max(1.0, std::sqrt(area / kStereoPixels));
  StereoView stereo;
  stereo.view = view;
  stereo.width = std::max(1, static_cast<int>(std::lround(photo.width / reduction)));
  stereo.height = std::max(1, static_cast<int>(std::lround(photo.height / reduction)));
  // Photo pixels in a pixel of the view, along each axis.
  const Eigen::Vector2d scale(double(photo.width) / stereo.width,
                              double(photo.height) / stereo.height);
  stereo.focal = Eigen::Vector2d(pinhole.params[0], pinhole.params[1]).cwiseQuotient(scale);
  stereo.center = Eigen::Vector2d(pinhole.params[2], pinhole.params[3]).cwiseQuotient(scale);
  stereo.origin = scene.Origin(view);
  stereo.cam_from_world = PoseOf(photo).UnitRotation().toRotationMatrix();
  const size_t num_pixels = static_cast<size_t>(stereo.width) * stereo.height;
  stereo.grey.assign(num_pixels, std::numeric_limits<float>::quiet_NaN());
  stereo.color.assign(num_pixels, Eigen::Vector3f::Zero());

  const std::unique_ptr<ViewPixels> pixels = scene.OpenView(view);
  const bool is_distorted = IsDistorted(camera);
  const int samples = std::clamp(static_cast<int>(std::lround(scale.maxCoeff())), 1, kMostSamples);
  // Returns where the photo shows what the view has at a pixel.
  const auto photo_pixel = [&](double x, double y) -> std::optional<Eigen::Vector2d> {
    const Eigen::Vector2d at(x, y);
    if (!is_distorted) return at.cwiseProduct(scale);
    return Project(camera, (at - stereo.center).cwiseQuotient(stereo.focal).homogeneous());
  };
  for (int y = 0; y < stereo.height; ++y) {
    for (int x = 0; x < stereo.width; ++x) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      bool is_seen = true;
      for (int k = 0; k < samples * samples && is_seen; ++k) {
        const std::optional<Eigen::Vector2d> at =
            photo_pixel(x + (k % samples + 0.5) / samples, y + (k / samples + 0.5) / samples);
        is_seen = at && AddInterpolated(*pixels, photo.width, photo.height, *at, &sum) &&
                  !scene.IsIgnored(view, static_cast<int>(at->x()), static_cast<int>(at->y()));
      }
      const std::optional<Eigen::Vector2d> middle = photo_pixel(x + 0.5, y + 0.5);
      if (!is_seen || !middle) continue;
      const Eigen::Vector3d mean = sum / (samples * samples);
      const size_t i = static_cast<size_t>(y) * stereo.width + x;
      const double luma = mean.dot(Eigen::Vector3d(0.2126, 0.7152, 0.0722));
      stereo.grey[i] = static_cast<float>(luma / 255 - 0.5);
      stereo.color[i] = ReferenceColorOf(scene, view, *middle, mean);
    }
  }
  return stereo;
}

}  // namespace semfoam
