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

// Windows are of 5 x 5 pixels.
inline constexpr int kWindowRadius = 2;

// Zero-mean normalised cross-correlation of a view's windows with those of other pictures. Keeps a
// reference to the view, which must be larger than a window.
class WindowCorrelation {
 public:
  // What Correlate computes in; threads must not share it.
  struct Buffers {
    ImageValues rows, product, sum, square_sum, product_sum;
  };

  explicit WindowCorrelation(const StereoView& view);

  // Returns whether the 3 x 3 pixels around a pixel, which must not be at the border, are nearly of
  // one colour (standard deviation below 1 % of white).
  bool IsFlat(int x, int y) const;

  // Returns the standard deviation of a pixel's window; NaN where it is nearly of one colour.
  float Deviation(size_t pixel) const { return 1 / scale_[pixel]; }

  // Computes the correlation of each window with that of `other`, of the view's size, -1..1;
  // kNoCorrelation where a window is incomplete or that of the view nearly of one colour.
  void Correlate(const ImageValues& other, Buffers* buffers, ImageValues* scores) const;

 private:
  const StereoView& view_;
  // Of the windows of the view: mean, and 1 / standard deviation.
  ImageValues mean_, scale_;
};

}  // namespace semfoam
