// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/camera_models.h"

#include "plugin/colmap/lens_distortion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr std::array<CameraModel, 18> kModels = {{
    {0, "SIMPLE_PINHOLE", 3, 1},
    {1, "PINHOLE", 4, 2},
    {2, "SIMPLE_RADIAL", 4, 1},
    {3, "RADIAL", 5, 1},
    {4, "OPENCV", 8, 2},
    {5, "OPENCV_FISHEYE", 8, 2},
    {6, "FULL_OPENCV", 12, 2},
    {7, "FOV", 5, 2},
    {8, "SIMPLE_RADIAL_FISHEYE", 4, 1},
    {9, "RADIAL_FISHEYE", 5, 1},
    {10, "THIN_PRISM_FISHEYE", 12, 2},
    {11, "RAD_TAN_THIN_PRISM_FISHEYE", 16, 2},
    {12, "SIMPLE_DIVISION", 4, 1},
    {13, "DIVISION", 5, 2},
    {14, "SIMPLE_FISHEYE", 3, 1},
    {15, "FISHEYE", 4, 2},
    {16, "EUCM", 6, 2},
    {17, "EQUIRECTANGULAR", 2, 0},
}};

// tan(x) / x and atan(x) / x, right at 0 too.
double TanOverX(double x) { return std::abs(x) < 1e-4 ? 1 + x * x / 3 : std::tan(x) / x; }
double AtanOverX(double x) { return std::abs(x) < 1e-4 ? 1 - x * x / 3 : std::atan(x) / x; }

// FOV (Devernay and Faugeras 2001): r_distorted = atan(2 r tan(w / 2)) / w. Both ways in closed
// form; the two quotients have their limits at w = 0 and r = 0.
double FovDistortionFactor(double w, double r) {
  const double slope = TanOverX(w / 2);  // 2 tan(w / 2) / w
  return slope * AtanOverX(r * w * slope);
}

std::optional<double> FovUndistortionFactor(double w, double r_distorted) {
  const double angle = r_distorted * w;
  if (!(std::abs(angle) < std::numbers::pi / 2)) return std::nullopt;
  return TanOverX(angle) / TanOverX(w / 2);
}

struct Intrinsics {
  double fx;
  double fy;
  double cx;
  double cy;
  const double* distortion;
};

Intrinsics IntrinsicsOf(const Camera& camera) {
  const CameraModel& model = kModels.at(camera.model_id);
  CHECK_EQ(camera.params.size(), static_cast<size_t>(model.num_params));
  const double* p = camera.params.data();
  if (model.num_focal_lengths == 0) {
    return {p[0] / (2 * std::numbers::pi), p[1] / std::numbers::pi, p[0] / 2, p[1] / 2, p + 2};
  }
  if (model.num_focal_lengths == 1) return {p[0], p[0], p[1], p[2], p + 3};
  return {p[0], p[1], p[2], p[3], p + 4};
}

bool IsFisheye(int model_id) {
  switch (model_id) {
    case 5:
    case 8:
    case 9:
    case 10:
    case 11:
    case 14:
    case 15:
      return true;
    default:
      return false;
  }
}

constexpr int kFov = 7;
constexpr int kSimpleDivision = 12;
constexpr int kDivision = 13;
constexpr int kEucm = 16;
constexpr int kEquirectangular = 17;

// Calls visitor.operator()<Distortion>() with the distortion of the model, for those that have
// one.
template <typename Visitor>
auto WithDistortion(int model_id, Visitor&& visitor) {
  switch (model_id) {
    case 2:
    case 8:
      return visitor.template operator()<RadialDistortion<1>>();
    case 3:
    case 9:
      return visitor.template operator()<RadialDistortion<2>>();
    case 4:
      return visitor.template operator()<OpenCvDistortion>();
    case 5:
      return visitor.template operator()<RadialDistortion<4>>();
    case 6:
      return visitor.template operator()<FullOpenCvDistortion>();
    case 10:
      return visitor.template operator()<ThinPrismDistortion>();
    case 11:
      return visitor.template operator()<RadTanThinPrismDistortion>();
    default:
      return visitor.template operator()<RadialDistortion<0>>();
  }
}

// Returns the point of the image plane, before focal length and principal point, that shows x_cam.
std::optional<Eigen::Vector2d> ToImagePlane(int model_id,
                                            const double* k,
                                            const Eigen::Vector3d& x_cam) {
  const double rho = x_cam.head<2>().norm();
  Eigen::Vector2d uv;
  if (IsFisheye(model_id)) {
    if (rho == 0 && !(x_cam.z() > 0)) return std::nullopt;
    uv = rho == 0 ? Eigen::Vector2d::Zero()
                  : Eigen::Vector2d(x_cam.head<2>() * (std::atan2(rho, x_cam.z()) / rho));
  } else if (model_id == kEquirectangular) {
    if (!(x_cam.norm() > 0)) return std::nullopt;
    return Eigen::Vector2d(std::atan2(x_cam.x(), x_cam.z()),
                           std::atan2(x_cam.y(), std::hypot(x_cam.x(), x_cam.z())));
  } else if (model_id == kSimpleDivision || model_id == kDivision) {
    const double square = x_cam.z() * x_cam.z() - 4 * k[0] * rho * rho;
    const double denominator = x_cam.z() + std::sqrt(square);
    if (!(square >= 0 && denominator > 0)) return std::nullopt;
    return x_cam.head<2>() * (2 / denominator);
  } else {
    if (!(x_cam.z() > 0)) return std::nullopt;
    if (model_id == kEucm) {
      const double length = std::sqrt(k[1] * rho * rho + x_cam.z() * x_cam.z());
      return x_cam.head<2>() / (k[0] * length + (1 - k[0]) * x_cam.z());
    }
    uv = x_cam.head<2>() / x_cam.z();
  }
  if (model_id == kFov) return uv * FovDistortionFactor(k[0], uv.norm());
  Eigen::Vector2d distorted;
  WithDistortion(model_id, [&]<typename Distortion>() {
    Distortion::Apply(k, uv.x(), uv.y(), &distorted.x(), &distorted.y());
  });
  return distorted;
}

// Returns the unit direction that a point of the image plane shows: the inverse of ToImagePlane.
std::optional<Eigen::Vector3d> FromImagePlane(int model_id,
                                              const double* k,
                                              const Eigen::Vector2d& image,
                                              bool distorted) {
  const double r2 = image.squaredNorm();
  if (model_id == kEquirectangular) {
    const double azimuth = image.x(), elevation = image.y();
    constexpr double kRounding = 1e-9;  // at the very borders of the image
    if (std::abs(azimuth) > std::numbers::pi + kRounding ||
        std::abs(elevation) > std::numbers::pi / 2 + kRounding) {
      return std::nullopt;
    }
    return Eigen::Vector3d(std::cos(elevation) * std::sin(azimuth),
                           std::sin(elevation),
                           std::cos(elevation) * std::cos(azimuth));
  }
  if (model_id == kSimpleDivision || model_id == kDivision) {
    // r / (1 + k r^2) grows up to k r^2 = 1.
    if (!(k[0] * r2 < 1)) return std::nullopt;
    return Eigen::Vector3d(image.x(), image.y(), 1 + k[0] * r2).normalized();
  }
  if (model_id == kEucm) {
    const double square = 1 - (2 * k[0] - 1) * k[1] * r2;
    const double z = (1 - k[0] * k[0] * k[1] * r2) / (k[0] * std::sqrt(square) + 1 - k[0]);
    if (!(square >= 0 && z > 0)) return std::nullopt;
    return Eigen::Vector3d(image.x(), image.y(), z).normalized();
  }
  std::optional<Eigen::Vector2d> uv = image;
  if (model_id == kFov) {
    const auto factor = FovUndistortionFactor(k[0], image.norm());
    uv = factor ? std::optional<Eigen::Vector2d>(image * *factor) : std::nullopt;
  } else if (distorted) {
    uv = WithDistortion(model_id,
                        [&]<typename Distortion>() { return Undistort<Distortion>(k, image); });
  }
  if (!uv) return std::nullopt;
  if (!IsFisheye(model_id)) return Eigen::Vector3d(uv->x(), uv->y(), 1).normalized();
  const double theta = uv->norm();
  if (theta > std::numbers::pi) return std::nullopt;
  const double sine_over_theta = theta < 1e-8 ? 1 : std::sin(theta) / theta;
  return Eigen::Vector3d(uv->x() * sine_over_theta, uv->y() * sine_over_theta, std::cos(theta));
}

}  // namespace

const CameraModel* FindCameraModel(int model_id) {
  const bool known = model_id >= 0 && model_id < static_cast<int>(kModels.size());
  return known ? &kModels[model_id] : nullptr;
}

const CameraModel* FindCameraModel(std::string_view name) {
  const auto found = std::find_if(
      kModels.begin(), kModels.end(), [&](const CameraModel& m) { return m.name == name; });
  return found == kModels.end() ? nullptr : &*found;
}

bool MustBePositive(const CameraModel& model, int parameter) {
  return model.num_focal_lengths == 0 || parameter < model.num_focal_lengths;
}

bool IsDistorted(const Camera& camera) {
  const Intrinsics in = IntrinsicsOf(camera);
  if (IsFisheye(camera.model_id) || camera.model_id == kEquirectangular) return true;
  const double* end = camera.params.data() + camera.params.size();
  return std::any_of(in.distortion, end, [](double k) { return k != 0; });
}

std::optional<Eigen::Vector2d> Project(const Camera& camera, const Eigen::Vector3d& x_cam) {
  const Intrinsics in = IntrinsicsOf(camera);
  const std::optional<Eigen::Vector2d> image = ToImagePlane(camera.model_id, in.distortion, x_cam);
  if (!image) return std::nullopt;
  const Eigen::Vector2d pixel(in.fx * image->x() + in.cx, in.fy * image->y() + in.cy);
  if (!pixel.allFinite()) return std::nullopt;
  return pixel;
}

std::optional<Eigen::Vector3d> Unproject(const Camera& camera, const Eigen::Vector2d& pixel) {
  const Intrinsics in = IntrinsicsOf(camera);
  const Eigen::Vector2d image((pixel.x() - in.cx) / in.fx, (pixel.y() - in.cy) / in.fy);
  std::optional<Eigen::Vector3d> ray =
      FromImagePlane(camera.model_id, in.distortion, image, IsDistorted(camera));
  if (!ray || !ray->allFinite()) return std::nullopt;
  return ray;
}

double DistortionAtCorners(const Camera& camera) {
  if (!IsDistorted(camera)) return 0;
  const Camera pinhole = WithoutDistortion(camera);
  const auto width = static_cast<double>(camera.width);
  const auto height = static_cast<double>(camera.height);
  double largest = 0;
  for (const Eigen::Vector2d& corner : {Eigen::Vector2d(0, 0),
                                        Eigen::Vector2d(width, 0),
                                        Eigen::Vector2d(0, height),
                                        Eigen::Vector2d(width, height)}) {
    const std::optional<Eigen::Vector3d> ray = Unproject(camera, corner);
    const std::optional<Eigen::Vector2d> straight = ray ? Project(pinhole, *ray) : std::nullopt;
    if (!straight) return std::numeric_limits<double>::infinity();
    largest = std::max(largest, (*straight - corner).norm());
  }
  return largest;
}

Camera WithoutDistortion(const Camera& camera) {
  const Intrinsics in = IntrinsicsOf(camera);
  Camera pinhole = camera;
  pinhole.model_id = FindCameraModel("PINHOLE")->id;
  pinhole.params = {in.fx, in.fy, in.cx, in.cy};
  return pinhole;
}

Camera RescaledCamera(const Camera& camera, uint64_t width, uint64_t height) {
  const CameraModel& model = kModels.at(camera.model_id);
  const double sx = static_cast<double>(width) / static_cast<double>(camera.width);
  const double sy = static_cast<double>(height) / static_cast<double>(camera.height);
  Camera result = camera;
  result.width = width;
  result.height = height;
  int next = 0;
  if (model.num_focal_lengths == 0) {
    result.params = {sx * camera.params[0], sy * camera.params[1]};
    return result;
  }
  if (model.num_focal_lengths == 1) {
    result.params[next++] *= (sx + sy) / 2;
  } else {
    result.params[next++] *= sx;
    result.params[next++] *= sy;
  }
  result.params[next++] *= sx;
  result.params[next] *= sy;
  return result;
}

}  // namespace semfoam
