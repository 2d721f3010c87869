// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/stereo_view.h"

#include <cstddef>
#include <vector>

namespace semfoam {

// Weighted sums over the pixels of a photo around each of them, which end where its colour changes:
// the weight of a pixel is exp(-c / color_reach - s / reach), where s is the length of a path to
// it, first along rows, then along columns or the other way round, and c the sum of the changes of
// display values on it, of each what is above `free_change` (after the domain transform of Gastal
// and Oliveira, SIGGRAPH 2011).
class ImagePaths {
 public:
  // `reach` is in pixels, `color_reach` in display values; both > 0.
  ImagePaths(const StereoView& view, double color_reach, double reach, double free_change = 0);

  // Returns the sums of `own` [pixels] around all pixels: the mean of those by the two kinds of
  // paths. Sums is an Eigen array of fixed size.
  template <typename Sums>
  std::vector<Sums> SumsAround(const std::vector<Sums>& own) const {
    std::vector<Sums> sums = own;
    SumRows(&sums);
    SumColumns(&sums);
    std::vector<Sums> other = own;
    SumColumns(&other);
    SumRows(&other);
    for (size_t i = 0; i < sums.size(); ++i) sums[i] = 0.5f * (sums[i] + other[i]);
    return sums;
  }

 private:
  // Replaces the values of `count` pixels, `step` apart, by the weighted sums over all of them.
  // `passes` of a pixel leads to the next one.
  template <typename Sums>
  static void SumAlong(const float* passes, int count, ptrdiff_t step, Sums* pixels) {
    std::vector<Sums> from_before(count, Sums::Zero());
    for (int k = 1; k < count; ++k) {
      const ptrdiff_t before = (k - 1) * step;
      from_before[k] = passes[before] * (from_before[k - 1] + pixels[before]);
    }
    Sums from_behind = Sums::Zero();
    for (int k = count - 1; k >= 0; --k) {
      Sums& pixel = pixels[k * step];
      const Sums own = pixel;
      pixel += from_before[k] + from_behind;
      if (k > 0) from_behind = passes[(k - 1) * step] * (from_behind + own);
    }
  }

  template <typename Sums>
  void SumRows(std::vector<Sums>* sums) const {
    for (int y = 0; y < height_; ++y) {
      const size_t first = static_cast<size_t>(y) * width_;
      SumAlong(&right_[first], width_, 1, &(*sums)[first]);
    }
  }

  template <typename Sums>
  void SumColumns(std::vector<Sums>* sums) const {
    for (int x = 0; x < width_; ++x) SumAlong(&down_[x], height_, width_, &(*sums)[x]);
  }

  int width_, height_;
  // [height][width] The weights that are left on the way from a pixel to its right and its lower
  // neighbour.
  std::vector<float> right_, down_;
};

// Returns the largest change of display values from pixel to pixel that the noise of a photo makes,
// by what changes in its plainest parts.
double PhotoNoise(const StereoView& view);

}  // namespace semfoam
