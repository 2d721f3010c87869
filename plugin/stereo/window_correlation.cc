// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/window_correlation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>

namespace semfoam {
namespace {

constexpr float kLeastDeviation = 0.01f;

}  // namespace

WindowSums::WindowSums(int width, int height) : width_(width), height_(height) {
  rows_.resize(static_cast<size_t>(width) * height);
}

void WindowSums::Sum(const ImageValues& values, ImageValues* sums) {
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
static_assert(WindowSums::kRadius == 2);

WindowCorrelation::WindowCorrelation(const StereoView& view)
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
    mean_[i] /= WindowSums::kNumPixels;
    const float variance = square_sum_[i] / WindowSums::kNumPixels - mean_[i] * mean_[i];
    // NaN stays NaN.
    scale_[i] = variance < kLeastDeviation * kLeastDeviation
                    ? std::numeric_limits<float>::quiet_NaN()
                    : 1 / std::sqrt(variance);
  }
}

bool WindowCorrelation::IsFlat(int x, int y, int width) const {
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

void WindowCorrelation::Correlate(const ImageValues& warped, ImageValues* scores) {
  sums_.Sum(warped, &sum_);
  for (size_t i = 0; i < grey_.size(); ++i) product_[i] = warped[i] * warped[i];
  sums_.Sum(product_, &square_sum_);
  for (size_t i = 0; i < grey_.size(); ++i) product_[i] = warped[i] * grey_[i];
  sums_.Sum(product_, &product_sum_);
  constexpr float kLeastVariance = kLeastDeviation * kLeastDeviation / 4;
  const auto array = [&](const ImageValues& plane) {
    return Eigen::Map<const Eigen::ArrayXf>(plane.data(), static_cast<Eigen::Index>(plane.size()));
  };
  Eigen::Map<Eigen::ArrayXf> score(scores->data(), static_cast<Eigen::Index>(scores->size()));
  const auto mean = array(sum_) / WindowSums::kNumPixels;
  const auto variance =
      (array(square_sum_) / WindowSums::kNumPixels - mean * mean).max(kLeastVariance);
  const auto covariance = array(product_sum_) / WindowSums::kNumPixels - mean * array(mean_);
  // As arrays, because a compiler does not turn a loop with square roots into vector code.
  score = covariance * array(scale_) / variance.sqrt();
  score = (score >= kNoCorrelation).select(score, kNoCorrelation);
}

}  // namespace semfoam
