// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/camera_models.h"

#include "foam/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr std::array<CameraModel, 18> kModels = {{
    {0, "SIMPLE_PINHOLE", 3, 1, true},
    {1, "PINHOLE", 4, 2, true},
    {2, "SIMPLE_RADIAL", 4, 1, true},
    {3, "RADIAL", 5, 1, true},
    {4, "OPENCV", 8, 2, true},
    {5, "OPENCV_FISHEYE", 8, 2, true},
    {6, "FULL_OPENCV", 12, 2, true},
    {7, "FOV", 5, 2, true},
    {8, "SIMPLE_RADIAL_FISHEYE", 4, 1, true},
    {9, "RADIAL_FISHEYE", 5, 1, true},
    {10, "THIN_PRISM_FISHEYE", 12, 2, true},
    {11, "RAD_TAN_THIN_PRISM_FISHEYE", 16, 2, false},
    {12, "SIMPLE_DIVISION", 4, 1, false},
    {13, "DIVISION", 5, 2, false},
    {14, "SIMPLE_FISHEYE", 3, 1, false},
    {15, "FISHEYE", 4, 2, false},
    {16, "EUCM", 6, 2, false},
    {17, "EQUIRECTANGULAR", 2, 0, false},
}};

// A number and its derivatives by the two coordinates of a point: what Newton's method needs of
// the distortion, exactly and from the one formula.
struct Dual {
  double value;
  double du = 0;
  double dv = 0;

  Dual(double value) : value(value) {}  // NOLINT: a plain number is a constant
  Dual(double value, double du, double dv) : value(value), du(du), dv(dv) {}
};

Dual operator+(const Dual& a, const Dual& b) {
  return {a.value + b.value, a.du + b.du, a.dv + b.dv};
}
Dual operator*(const Dual& a, const Dual& b) {
  return {a.value * b.value, a.value * b.du + b.value * a.du, a.value * b.dv + b.value * a.dv};
}
Dual operator/(const Dual& a, const Dual& b) {
  const double q = a.value / b.value;
  return {q, (a.du - q * b.du) / b.value, (a.dv - q * b.dv) / b.value};
}

// The distortions map (u, v) to (x, y). For perspective models (u, v) is the point on the plane at
// depth 1; for fisheye models it is the same direction at the length theta, the angle to the axis.
// `k` are the model's parameters after the principal point.

// x = u (1 + k_0 r^2 + k_1 r^4 + ...): SIMPLE_RADIAL, RADIAL and, in theta, their fisheyes and
// OPENCV_FISHEYE.
template <int kNumCoefficients>
struct RadialDistortion {
  template <typename T>
  static void Apply(const double* k, const T& u, const T& v, T* x, T* y) {
    const T r2 = u * u + v * v;
    T factor = 0.0;
    for (int i = kNumCoefficients - 1; i >= 0; --i) factor = (factor + T(k[i])) * r2;
    factor = factor + T(1.0);
    *x = u * factor;
    *y = v * factor;
  }
};

template <typename T>
T TangentialX(double p1, double p2, const T& u, const T& v, const T& r2) {
  return T(2 * p1) * u * v + T(p2) * (r2 + T(2.0) * u * u);
}

template <typename T>
T TangentialY(double p1, double p2, const T& u, const T& v, const T& r2) {
  return T(2 * p2) * u * v + T(p1) * (r2 + T(2.0) * v * v);
}

// k: k1 k2 p1 p2
struct OpenCvDistortion {
  template <typename T>
  static void Apply(const double* k, const T& u, const T& v, T* x, T* y) {
    const T r2 = u * u + v * v;
    const T factor = T(1.0) + r2 * (T(k[0]) + r2 * T(k[1]));
    *x = u * factor + TangentialX(k[2], k[3], u, v, r2);
    *y = v * factor + TangentialY(k[2], k[3], u, v, r2);
  }
};

// k: k1 k2 p1 p2 k3 k4 k5 k6
struct FullOpenCvDistortion {
  template <typename T>
  static void Apply(const double* k, const T& u, const T& v, T* x, T* y) {
    const T r2 = u * u + v * v;
    const T factor = (T(1.0) + r2 * (T(k[0]) + r2 * (T(k[1]) + r2 * T(k[4])))) /
                     (T(1.0) + r2 * (T(k[5]) + r2 * (T(k[6]) + r2 * T(k[7]))));
    *x = u * factor + TangentialX(k[2], k[3], u, v, r2);
    *y = v * factor + TangentialY(k[2], k[3], u, v, r2);
  }
};

// k: k1 k2 p1 p2 k3 k4 sx1 sy1
struct ThinPrismDistortion {
  template <typename T>
  static void Apply(const double* k, const T& u, const T& v, T* x, T* y) {
    const T r2 = u * u + v * v;
    const T factor = T(1.0) + r2 * (T(k[0]) + r2 * (T(k[1]) + r2 * (T(k[4]) + r2 * T(k[5]))));
    *x = u * factor + TangentialX(k[2], k[3], u, v, r2) + T(k[6]) * r2;
    *y = v * factor + TangentialY(k[2], k[3], u, v, r2) + T(k[7]) * r2;
  }
};

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

struct Jacobian {
  Dual x = 0.0;
  Dual y = 0.0;
  double Determinant() const { return x.du * y.dv - x.dv * y.du; }
  double Trace() const { return x.du + y.dv; }
};

template <typename Distortion>
Jacobian Linearize(const double* k, const Eigen::Vector2d& point) {
  Jacobian result;
  Distortion::Apply(k, Dual(point.x(), 1, 0), Dual(point.y(), 0, 1), &result.x, &result.y);
  return result;
}

// Newton's method for the (u, v) that the distortion maps to `target`; empty where it does not
// converge.
template <typename Distortion>
std::optional<Eigen::Vector2d> Solve(const double* k,
                                     const Eigen::Vector2d& target,
                                     const Eigen::Vector2d& start) {
  constexpr int kMaxIterations = 100;
  constexpr double kConverged = 1e-13;  // relative step: some digits above rounding
  Eigen::Vector2d point = start;
  for (int i = 0; i < kMaxIterations; ++i) {
    const Jacobian j = Linearize<Distortion>(k, point);
    const double determinant = j.Determinant();
    const double ex = j.x.value - target.x();
    const double ey = j.y.value - target.y();
    Eigen::Vector2d step((j.y.dv * ex - j.x.dv * ey) / determinant,
                         (j.x.du * ey - j.y.du * ex) / determinant);
    if (!step.allFinite()) return std::nullopt;
    // The limit keeps the iteration near the root next to the start: the ones farther out are
    // beyond a fold of the distortion.
    const double limit = std::max(0.1 * point.norm(), 0.1);
    if (step.norm() > limit) step *= limit / step.norm();
    point -= step;
    if (step.norm() <= kConverged * (1 + point.norm())) return point;
  }
  return std::nullopt;
}

// Between the axis and the root the distortion must neither turn nor fold; where it does, the lens
// sees the same pixel in two directions and the root is not the one that was photographed.
template <typename Distortion>
bool IsBeforeFold(const double* k, const Eigen::Vector2d& point) {
  constexpr int kSamples = 8;
  for (int i = 1; i <= kSamples; ++i) {
    const Jacobian j = Linearize<Distortion>(k, point * (static_cast<double>(i) / kSamples));
    if (!(j.Determinant() > 0 && j.Trace() > 0)) return false;
  }
  return true;
}

// The (u, v) before the first fold that the distortion maps to `target`.
template <typename Distortion>
std::optional<Eigen::Vector2d> Undistort(const double* k, const Eigen::Vector2d& target) {
  const auto near_target = Solve<Distortion>(k, target, target);
  if (near_target && IsBeforeFold<Distortion>(k, *near_target)) return near_target;
  // A distortion that pushes outwards before it folds may have its fold at `target` or nearer to
  // the axis, and nothing to find from there. Outwards from the axis the root before it comes
  // first.
  constexpr int kSteps = 16;
  Eigen::Vector2d point = Eigen::Vector2d::Zero();
  for (int i = 1; i <= kSteps; ++i) {
    const auto next = Solve<Distortion>(k, target * (static_cast<double>(i) / kSteps), point);
    if (!next) return std::nullopt;
    point = *next;
  }
  if (!IsBeforeFold<Distortion>(k, point)) return std::nullopt;
  return point;
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
  CHECK(model.has_rays) << model.name;
  CHECK_EQ(camera.params.size(), static_cast<size_t>(model.num_params));
  const double* p = camera.params.data();
  if (model.num_focal_lengths == 1) return {p[0], p[0], p[1], p[2], p + 3};
  return {p[0], p[1], p[2], p[3], p + 4};
}

bool IsFisheye(int model_id) {
  return model_id == 5 || model_id == 8 || model_id == 9 || model_id == 10;
}

// Calls visitor.operator()<Distortion>() with the distortion of the model; FOV has its own way.
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
    default:
      return visitor.template operator()<RadialDistortion<0>>();
  }
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

void RequireRays(const Camera& camera, const std::filesystem::path& file) {
  const CameraModel& model = kModels.at(camera.model_id);
  if (model.has_rays) return;
  throw UserError(file.string(),
                  ": camera ",
                  camera.id,
                  " has the model ",
                  model.name,
                  ", whose rays are not known here; undistort the photos with `colmap "
                  "image_undistorter` or use one of COLMAP's models up to THIN_PRISM_FISHEYE.");
}

bool IsDistorted(const Camera& camera) {
  const Intrinsics in = IntrinsicsOf(camera);
  if (IsFisheye(camera.model_id)) return true;
  const double* end = camera.params.data() + camera.params.size();
  return std::any_of(in.distortion, end, [](double k) { return k != 0; });
}

std::optional<Eigen::Vector2d> Project(const Camera& camera, const Eigen::Vector3d& x_cam) {
  const Intrinsics in = IntrinsicsOf(camera);
  Eigen::Vector2d uv;
  if (IsFisheye(camera.model_id)) {
    const double rho = x_cam.head<2>().norm();
    if (rho == 0 && !(x_cam.z() > 0)) return std::nullopt;
    uv = rho == 0 ? Eigen::Vector2d::Zero()
                  : Eigen::Vector2d(x_cam.head<2>() * (std::atan2(rho, x_cam.z()) / rho));
  } else {
    if (!(x_cam.z() > 0)) return std::nullopt;
    uv = x_cam.head<2>() / x_cam.z();
  }
  Eigen::Vector2d distorted;
  if (camera.model_id == 7) {
    distorted = uv * FovDistortionFactor(in.distortion[0], uv.norm());
  } else {
    WithDistortion(camera.model_id, [&]<typename Distortion>() {
      Distortion::Apply(in.distortion, uv.x(), uv.y(), &distorted.x(), &distorted.y());
    });
  }
  const Eigen::Vector2d pixel(in.fx * distorted.x() + in.cx, in.fy * distorted.y() + in.cy);
  if (!pixel.allFinite()) return std::nullopt;
  return pixel;
}

std::optional<Eigen::Vector3d> Unproject(const Camera& camera, const Eigen::Vector2d& pixel) {
  const Intrinsics in = IntrinsicsOf(camera);
  const Eigen::Vector2d distorted((pixel.x() - in.cx) / in.fx, (pixel.y() - in.cy) / in.fy);
  std::optional<Eigen::Vector2d> uv = distorted;
  if (camera.model_id == 7) {
    const auto factor = FovUndistortionFactor(in.distortion[0], distorted.norm());
    uv = factor ? std::optional<Eigen::Vector2d>(distorted * *factor) : std::nullopt;
  } else if (IsDistorted(camera)) {
    uv = WithDistortion(camera.model_id, [&]<typename Distortion>() {
      return Undistort<Distortion>(in.distortion, distorted);
    });
  }
  if (!uv || !uv->allFinite()) return std::nullopt;
  if (!IsFisheye(camera.model_id)) return Eigen::Vector3d(uv->x(), uv->y(), 1).normalized();
  const double theta = uv->norm();
  if (theta > std::numbers::pi) return std::nullopt;
  const double sine_over_theta = theta < 1e-8 ? 1 : std::sin(theta) / theta;
  return Eigen::Vector3d(uv->x() * sine_over_theta, uv->y() * sine_over_theta, std::cos(theta));
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
  CHECK_GT(model.num_focal_lengths, 0) << model.name;
  const double sx = static_cast<double>(width) / static_cast<double>(camera.width);
  const double sy = static_cast<double>(height) / static_cast<double>(camera.height);
  Camera result = camera;
  result.width = width;
  result.height = height;
  int next = 0;
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
