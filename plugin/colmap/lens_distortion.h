// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <optional>

#include <Eigen/Core>

namespace semfoam {

// The polynomial and rational distortions of COLMAP's camera models, and their inversion by
// Newton's method. For camera_models.cc.

// A number and its derivatives by the two coordinates of a point, with which Newton's method gets
// exact derivatives from the formula of the distortion.
struct Dual {
  double value = 0;
  double du = 0;
  double dv = 0;

  Dual() = default;
  Dual(double value) : value(value) {}  // NOLINT: a plain number is a constant
  Dual(double value, double du, double dv) : value(value), du(du), dv(dv) {}
};

inline Dual operator+(const Dual& a, const Dual& b) {
  return {a.value + b.value, a.du + b.du, a.dv + b.dv};
}
inline Dual operator*(const Dual& a, const Dual& b) {
  return {a.value * b.value, a.value * b.du + b.value * a.du, a.value * b.dv + b.value * a.dv};
}
inline Dual operator/(const Dual& a, const Dual& b) {
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

// k: k0 .. k5 p0 p1 s0 s1 s2 s3. The tangential and prism terms are functions of the point after
// the radial factor.
struct RadTanThinPrismDistortion {
  template <typename T>
  static void Apply(const double* k, const T& u, const T& v, T* x, T* y) {
    T radial_x, radial_y;
    RadialDistortion<6>::Apply(k, u, v, &radial_x, &radial_y);
    const T r2 = radial_x * radial_x + radial_y * radial_y;
    *x = radial_x + TangentialX(k[7], k[6], radial_x, radial_y, r2) + r2 * (T(k[8]) + r2 * T(k[9]));
    *y = radial_y + TangentialY(k[7], k[6], radial_x, radial_y, r2) +
         r2 * (T(k[10]) + r2 * T(k[11]));
  }
};

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

// Finds by Newton's method the (u, v) that the distortion maps to `target`; returns nothing where
// it does not converge.
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
    // The limit keeps the iteration near the root next to the start: roots farther out are beyond a
    // fold of the distortion.
    const double limit = std::max(0.1 * point.norm(), 0.1);
    if (step.norm() > limit) step *= limit / step.norm();
    point -= step;
    if (step.norm() <= kConverged * (1 + point.norm())) return point;
  }
  return std::nullopt;
}

// Returns whether the distortion neither turns nor folds between the axis and the root. Where it
// does, two directions share the pixel, and the root is not the photographed one.
template <typename Distortion>
bool IsBeforeFold(const double* k, const Eigen::Vector2d& point) {
  constexpr int kSamples = 8;
  for (int i = 1; i <= kSamples; ++i) {
    const Jacobian j = Linearize<Distortion>(k, point * (static_cast<double>(i) / kSamples));
    if (!(j.Determinant() > 0 && j.Trace() > 0)) return false;
  }
  return true;
}

// Returns the (u, v) before the first fold that the distortion maps to `target`.
template <typename Distortion>
std::optional<Eigen::Vector2d> Undistort(const double* k, const Eigen::Vector2d& target) {
  auto near_target = Solve<Distortion>(k, target, target);
  if (near_target && IsBeforeFold<Distortion>(k, *near_target)) return near_target;
  // A distortion that pushes outwards before it folds may have its fold at `target` or nearer to
  // the axis, so that Newton's method fails from there. A search outwards from the axis finds the
  // root before the fold first.
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

}  // namespace semfoam
