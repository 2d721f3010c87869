// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/plane_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>
#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr int kRadius = 2;
constexpr float kWindow = (2 * kRadius + 1) * (2 * kRadius + 1);
constexpr float kLeastDeviation = 0.01f;
constexpr float kLeastScore = 0.7f;
constexpr float kLeastLead = 0.05f;
// Pixels in a partner over which the score of one surface falls off.
constexpr double kPeakWidth = 2;
constexpr size_t kMostMatched = 4;
constexpr float kNone = -1;

using Plane = std::vector<float>;

// Sums over windows of (2 kRadius + 1)^2 pixels; NaN within kRadius of the border, and where a
// window has a NaN.
class WindowSums {
 public:
  WindowSums(int width, int height) : width_(width), height_(height) {
    rows_.resize(static_cast<size_t>(width) * height);
  }

  void Sum(const Plane& values, Plane* sums) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (int y = 0; y < height_; ++y) {
      const float* in = &values[static_cast<size_t>(y) * width_];
      float* out = &rows_[static_cast<size_t>(y) * width_];
      for (int x = kRadius; x < width_ - kRadius; ++x) {
        out[x] = in[x - 2] + in[x - 1] + in[x] + in[x + 1] + in[x + 2];
      }
    }
    std::fill(sums->begin(), sums->end(), nan);
    for (int y = kRadius; y < height_ - kRadius; ++y) {
      const float* in = &rows_[static_cast<size_t>(y) * width_];
      float* out = &(*sums)[static_cast<size_t>(y) * width_];
      const int w = width_;
      for (int x = kRadius; x < width_ - kRadius; ++x) {
        out[x] = in[x - 2 * w] + in[x - w] + in[x] + in[x + w] + in[x + 2 * w];
      }
    }
  }

 private:
  int width_, height_;
  Plane rows_;
};
static_assert(kRadius == 2);

// Maps pixels of a view, on a plane of inverse depth w, to pixels of another: hnormalized(
// turn * (x, y, 1) + w * shift).
struct Warp {
  Eigen::Matrix3f turn;
  Eigen::Vector3f shift;
};

Warp WarpBetween(const StereoView& from, const StereoView& to) {
  const auto matrix = [](const StereoView& view) {
    Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
    k(0, 0) = view.focal.x();
    k(1, 1) = view.focal.y();
    k.topRightCorner<2, 1>() = view.center;
    return k;
  };
  const Eigen::Matrix3d to_from = to.cam_from_world * from.cam_from_world.transpose();
  return {(matrix(to) * to_from * matrix(from).inverse()).cast<float>(),
          (matrix(to) * (to.cam_from_world * (from.origin - to.origin))).cast<float>()};
}

// Samples `to` where a plane shows it, between its pixels; NaN outside.
void WarpImage(const Warp& warp,
               float inverse_depth,
               int width,
               int height,
               const StereoView& to,
               Plane* warped) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> us(width), vs(width);
  const Eigen::Vector3f step = warp.turn.col(0);
  // Pixel centres of `to` are half a pixel from its corners.
  const auto last_u = static_cast<float>(to.width - 1);
  const auto last_v = static_cast<float>(to.height - 1);
  const float* grey = to.grey.data();
  for (int y = 0; y < height; ++y) {
    const Eigen::Vector3f begin =
        warp.turn * Eigen::Vector3f(0.5f, static_cast<float>(y) + 0.5f, 1) +
        inverse_depth * warp.shift;
    for (int x = 0; x < width; ++x) {
      const auto along = static_cast<float>(x);
      const float z = begin.z() + along * step.z();
      const float scale = z > 1e-6f ? 1 / z : nan;
      us[x] = (begin.x() + along * step.x()) * scale - 0.5f;
      vs[x] = (begin.y() + along * step.y()) * scale - 0.5f;
    }
    float* out = &(*warped)[static_cast<size_t>(y) * width];
    for (int x = 0; x < width; ++x) {
      const float u = us[x], v = vs[x];
      if (!(u >= 0 && v >= 0 && u < last_u && v < last_v)) {
        out[x] = nan;
        continue;
      }
      const int left = static_cast<int>(u), top = static_cast<int>(v);
      const float a = u - static_cast<float>(left), b = v - static_cast<float>(top);
      const float* at = grey + static_cast<size_t>(top) * to.width + left;
      const float upper = at[0] + a * (at[1] - at[0]);
      const float lower = at[to.width] + a * (at[to.width + 1] - at[to.width]);
      out[x] = upper + b * (lower - upper);
    }
  }
}

// Correlates windows of a view with windows of what its planes show.
class Correlator {
 public:
  explicit Correlator(const StereoView& view)
      : grey_(view.grey),
        sums_(view.width, view.height),
        mean_(grey_.size()),
        scale_(grey_.size()),
        product_(grey_.size()),
        sum_(grey_.size()),
        square_sum_(grey_.size()),
        product_sum_(grey_.size()) {
    for (size_t i = 0; i < grey_.size(); ++i) product_[i] = grey_[i] * grey_[i];
    sums_.Sum(grey_, &mean_);
    sums_.Sum(product_, &square_sum_);
    for (size_t i = 0; i < grey_.size(); ++i) {
      mean_[i] /= kWindow;
      const float variance = square_sum_[i] / kWindow - mean_[i] * mean_[i];
      // NaN stays NaN.
      scale_[i] = variance < kLeastDeviation * kLeastDeviation
                      ? std::numeric_limits<float>::quiet_NaN()
                      : 1 / std::sqrt(variance);
    }
  }

  // Returns whether the 3 x 3 pixels around a pixel, which must not be at the border, are of one
  // colour.
  bool IsFlat(int x, int y, int width) const {
    float sum = 0, square_sum = 0;
    for (int v = y - 1; v <= y + 1; ++v) {
      for (int u = x - 1; u <= x + 1; ++u) {
        const float value = grey_[static_cast<size_t>(v) * width + u];
        sum += value;
        square_sum += value * value;
      }
    }
    return square_sum / 9 - (sum / 9) * (sum / 9) < kLeastDeviation * kLeastDeviation;
  }

  // Computes the correlation with `warped`; kNone where a window is incomplete or of one colour.
  void Correlate(const Plane& warped, Plane* scores) {
    sums_.Sum(warped, &sum_);
    for (size_t i = 0; i < grey_.size(); ++i) product_[i] = warped[i] * warped[i];
    sums_.Sum(product_, &square_sum_);
    for (size_t i = 0; i < grey_.size(); ++i) product_[i] = warped[i] * grey_[i];
    sums_.Sum(product_, &product_sum_);
    constexpr float kLeastVariance = kLeastDeviation * kLeastDeviation / 4;
    const auto array = [&](const Plane& plane) {
      return Eigen::Map<const Eigen::ArrayXf>(plane.data(),
                                              static_cast<Eigen::Index>(plane.size()));
    };
    Eigen::Map<Eigen::ArrayXf> score(scores->data(), static_cast<Eigen::Index>(scores->size()));
    const auto mean = array(sum_) / kWindow;
    const auto variance = (array(square_sum_) / kWindow - mean * mean).max(kLeastVariance);
    const auto covariance = array(product_sum_) / kWindow - mean * array(mean_);
    // As arrays, because a compiler does not turn a loop with square roots into vector code.
    score = covariance * array(scale_) / variance.sqrt();
    score = (score >= kNone).select(score, kNone);
  }

 private:
  const Plane& grey_;
  WindowSums sums_;
  // Of the windows of the view: mean, and 1 / standard deviation.
  Plane mean_, scale_;
  Plane product_, sum_, square_sum_, product_sum_;
};

// Returns how many planes around the best one belong to its peak.
int PeakPlanes(const StereoView& view,
               const std::vector<const StereoView*>& partners,
               double spacing) {
  double widest = 0;
  for (const StereoView* partner : partners) {
    // The pixels by which a point in the middle moves from plane to plane, about.
    const double baseline = (partner->origin - view.origin).norm();
    widest = std::max(widest, partner->focal.x() * baseline * spacing);
  }
  return std::clamp(
      static_cast<int>(std::ceil(kPeakWidth / std::max(widest, 1e-9))), 2, kNumPlanes / 4);
}

// Returns the position of the maximum of the parabola through (-1, a), (0, b), (1, c), of which b
// is the largest.
float ParabolaPeak(float a, float b, float c) {
  const float curvature = a - 2 * b + c;
  return curvature < 0 ? std::clamp(0.5f * (a - c) / curvature, -0.5f, 0.5f) : 0;
}

}  // namespace

DepthMap SweepPlanes(const StereoView& view,
                     const std::vector<const StereoView*>& partners,
                     const InverseDepths& depths) {
  CHECK(!partners.empty() && partners.size() <= kMostMatched);
  const size_t num_pixels = view.NumPixels();
  DepthMap map;
  map.inverse.assign(num_pixels, 0.f);
  if (depths.IsEmpty() || partners.size() < 2 || view.width <= 2 * kRadius ||
      view.height <= 2 * kRadius) {
    return map;
  }
  const double spacing = (depths.near - depths.far) / (kNumPlanes - 1);
  std::vector<Warp> warps;
  warps.reserve(partners.size());
  for (const StereoView* partner : partners) warps.push_back(WarpBetween(view, *partner));

  Correlator correlator(view);
  Plane warped(num_pixels), scores(num_pixels), best(num_pixels), second(num_pixels);
  // [kNumPlanes][pixels]
  Plane volume(kNumPlanes * num_pixels);
  for (int plane = 0; plane < kNumPlanes; ++plane) {
    const auto inverse_depth = static_cast<float>(depths.far + plane * spacing);
    std::fill(best.begin(), best.end(), kNone);
    std::fill(second.begin(), second.end(), kNone);
    for (size_t k = 0; k < partners.size(); ++k) {
      WarpImage(warps[k], inverse_depth, view.width, view.height, *partners[k], &warped);
      correlator.Correlate(warped, &scores);
      for (size_t i = 0; i < num_pixels; ++i) {
        second[i] = std::max(second[i], std::min(best[i], scores[i]));
        best[i] = std::max(best[i], scores[i]);
      }
    }
    float* out = &volume[plane * num_pixels];
    for (size_t i = 0; i < num_pixels; ++i) out[i] = 0.5f * (best[i] + second[i]);
  }

  const int peak = PeakPlanes(view, partners, spacing);
  float of_pixel[kNumPlanes];
  for (size_t i = 0; i < num_pixels; ++i) {
    for (int plane = 0; plane < kNumPlanes; ++plane)
      of_pixel[plane] = volume[plane * num_pixels + i];
    const int winner =
        static_cast<int>(std::max_element(of_pixel, of_pixel + kNumPlanes) - of_pixel);
    const float score = of_pixel[winner];
    if (!(score >= kLeastScore) || winner == 0 || winner == kNumPlanes - 1) continue;
    if (correlator.IsFlat(
            static_cast<int>(i % view.width), static_cast<int>(i / view.width), view.width)) {
      continue;
    }
    float other = kNone;
    for (int plane = 0; plane < kNumPlanes; ++plane) {
      if (std::abs(plane - winner) > peak) other = std::max(other, of_pixel[plane]);
    }
    if (score - other < kLeastLead) continue;
    const float offset = ParabolaPeak(of_pixel[winner - 1], score, of_pixel[winner + 1]);
    map.inverse[i] = static_cast<float>(depths.far + (winner + offset) * spacing);
  }
  return map;
}

int64_t SweepPlanesBytes() {
  constexpr int64_t kOtherImages = 12;
  return (kNumPlanes + kOtherImages) * int64_t{sizeof(float)} * kStereoPixels * 102 / 100;
}

}  // namespace semfoam
