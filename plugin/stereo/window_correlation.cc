// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/window_correlation.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>

namespace semfoam {
namespace {

constexpr float kLeastDeviation = 0.01f;

constexpr float kWindowPixels = (2 * kWindowRadius + 1) * (2 * kWindowRadius + 1);

// Sums the values in the window around each pixel; NaN within two pixels of the border, and where a
// window has a NaN. `rows` is for what is computed on the way.
void SumWindows(
    const ImageValues& values, int width, int height, ImageValues* rows, ImageValues* sums) {
  static_assert(kWindowRadius == 2);
  rows->resize(values.size());
  sums->assign(values.size(), std::numeric_limits<float>::quiet_NaN());
  for (int y = 0; y < height; ++y) {
    const float* in = &values[static_cast<size_t>(y) * width];
    float* out = &(*rows)[static_cast<size_t>(y) * width];
    for (int x = kWindowRadius; x < width - kWindowRadius; ++x) {
      out[x] = in[x - 2] + in[x - 1] + in[x] + in[x + 1] + in[x + 2];
    }
  }
  for (int y = kWindowRadius; y < height - kWindowRadius; ++y) {
    const float* in = &(*rows)[static_cast<size_t>(y) * width];
    float* out = &(*sums)[static_cast<size_t>(y) * width];
    const int w = width;
    for (int x = kWindowRadius; x < width - kWindowRadius; ++x) {
      out[x] = in[x - 2 * w] + in[x - w] + in[x] + in[x + w] + in[x + 2 * w];
    }
  }
}

}  // namespace

WindowCorrelation::WindowCorrelation(const StereoView& view) : view_(view) {
  const ImageValues& grey = view.grey;
  ImageValues squares(grey.size()), square_sums, rows;
  for (size_t i = 0; i < grey.size(); ++i) squares[i] = grey[i] * grey[i];
  SumWindows(grey, view.width, view.height, &rows, &mean_);
  SumWindows(squares, view.width, view.height, &rows, &square_sums);
  scale_.resize(grey.size());
  for (size_t i = 0; i < grey.size(); ++i) {
    mean_[i] /= kWindowPixels;
    const float variance = square_sums[i] / kWindowPixels - mean_[i] * mean_[i];
    // NaN stays NaN.
    scale_[i] = variance < kLeastDeviation * kLeastDeviation
                    ? std::numeric_limits<float>::quiet_NaN()
                    : 1 / std::sqrt(variance);
  }
}

bool WindowCorrelation::IsFlat(int x, int y) const {
  float sum = 0, square_sum = 0;
  for (int v = y - 1; v <= y + 1; ++v) {
    for (int u = x - 1; u <= x + 1; ++u) {
      const float value = view_.grey[static_cast<size_t>(v) * view_.width + u];
      sum += value;
      square_sum += value * value;
    }
  }
  return square_sum / 9 - (sum / 9) * (sum / 9) < kLeastDeviation * kLeastDeviation;
}

void WindowCorrelation::Correlate(const ImageValues& other,
                                  Buffers* buffers,
                                  ImageValues* scores) const {
  const ImageValues& grey = view_.grey;
  auto& [rows, product, sum, square_sum, product_sum] = *buffers;
  product.resize(grey.size());
  SumWindows(other, view_.width, view_.height, &rows, &sum);
  for (size_t i = 0; i < grey.size(); ++i) product[i] = other[i] * other[i];
  SumWindows(product, view_.width, view_.height, &rows, &square_sum);
  for (size_t i = 0; i < grey.size(); ++i) product[i] = other[i] * grey[i];
  SumWindows(product, view_.width, view_.height, &rows, &product_sum);
  constexpr float kLeastVariance = kLeastDeviation * kLeastDeviation / 4;
  const auto array = [&](const ImageValues& plane) {
    return Eigen::Map<const Eigen::ArrayXf>(plane.data(), static_cast<Eigen::Index>(plane.size()));
  };
  Eigen::Map<Eigen::ArrayXf> score(scores->data(), static_cast<Eigen::Index>(scores->size()));
  const auto mean = array(sum) / kWindowPixels;
  const auto variance = (array(square_sum) / kWindowPixels - mean * mean).max(kLeastVariance);
  const auto covariance = array(product_sum) / kWindowPixels - mean * array(mean_);
  // As arrays, because a compiler does not turn a loop with square roots into vector code.
  score = covariance * array(scale_) / variance.sqrt();
  score = (score >= kNoCorrelation).select(score, kNoCorrelation);
}

}  // namespace semfoam
