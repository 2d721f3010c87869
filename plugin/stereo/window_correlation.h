// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/stereo_view.h"

#include <cstddef>
#include <vector>

namespace semfoam {

// How well two pictures agree around each pixel, whatever the brightness and contrast of either.

// [height][width]
using ImageValues = std::vector<float>;

// Score of pixels of which a correlation says nothing; the lowest that there is.
inline constexpr float kNoCorrelation = -1;

// Sums over windows of 5 x 5 pixels; NaN within two pixels of the border, and where a window has a
// NaN.
class WindowSums {
 public:
  static constexpr int kRadius = 2;
  static constexpr float kNumPixels = (2 * kRadius + 1) * (2 * kRadius + 1);

  WindowSums(int width, int height);

  // `values` and `sums` are two arrays of the image's size.
  void Sum(const ImageValues& values, ImageValues* sums);

 private:
  int width_, height_;
  ImageValues rows_;
};

// Zero-mean normalised cross-correlation of the windows (WindowSums) of a view with those of other
// pictures. Keeps a reference to the view, which must be larger than a window.
class WindowCorrelation {
 public:
  explicit WindowCorrelation(const StereoView& view);

  // Returns whether the 3 x 3 pixels around a pixel, which must not be at the border, are nearly of
  // one colour (standard deviation below 1 % of white).
  bool IsFlat(int x, int y, int width) const;

  // Returns the standard deviation of a pixel's window; NaN where it is nearly of one colour.
  float Deviation(size_t pixel) const { return 1 / scale_[pixel]; }

  // Computes the correlation of each window with that of `other`, of the view's size, -1..1;
  // kNoCorrelation where a window is incomplete or that of the view nearly of one colour.
  void Correlate(const ImageValues& other, ImageValues* scores);

 private:
  const ImageValues& grey_;
  WindowSums sums_;
  // Of the windows of the view: mean, and 1 / standard deviation.
  ImageValues mean_, scale_;
  ImageValues product_, sum_, square_sum_, product_sum_;
};

}  // namespace semfoam
