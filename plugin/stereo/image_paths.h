// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/stereo_view.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace semfoam {

// Weighted sums over the pixels of a photo around each of them, which end where its colour changes:
// the weight of a pixel is exp(-c / color_reach - s / reach), where s is the length of a path to
// it, first along rows, then along columns or the other way round, and c the sum of the changes of
// display values on it, of each what is above `free_change` (after the domain transform of Gastal
// and Oliveira, SIGGRAPH 2011). No path passes white that is cut off, which edges are lost in.
class ImagePaths {
 public:
  // `color_reach` > 0 and `free_change` are display values.
  ImagePaths(const StereoView& view, double color_reach, double free_change = 0);

  // Returns the sums of `own` [pixels] around all pixels: the mean of those by the two kinds of
  // paths. `reach` > 0 is in pixels; Sums is an Eigen array of fixed size.
  template <typename Sums>
  std::vector<Sums> SumsAround(const std::vector<Sums>& own, double reach) const {
    const auto decay = static_cast<float>(std::exp(-1 / reach));
    std::vector<Sums> line(std::max(width_, height_));
    std::vector<Sums> sums = own;
    SumRows(decay, &line, &sums);
    SumColumns(decay, &line, &sums);
    std::vector<Sums> other = own;
    SumColumns(decay, &line, &other);
    SumRows(decay, &line, &other);
    for (size_t i = 0; i < sums.size(); ++i) sums[i] = 0.5f * (sums[i] + other[i]);
    return sums;
  }

 private:
  // Replaces the values of `count` pixels, `step` apart, by the weighted sums over all of them.
  // `passes` of a pixel leads to the next one. Overwrites `line` [count].
  template <typename Sums>
  static void SumAlong(const float* passes,
                       int count,
                       ptrdiff_t step,
                       float decay,
                       std::vector<Sums>* line,
                       Sums* pixels) {
    std::vector<Sums>& from_before = *line;
    from_before[0].setZero();
    for (int k = 1; k < count; ++k) {
      const ptrdiff_t before = (k - 1) * step;
      from_before[k] = decay * passes[before] * (from_before[k - 1] + pixels[before]);
    }
    Sums from_behind = Sums::Zero();
    for (int k = count - 1; k >= 0; --k) {
      Sums& pixel = pixels[k * step];
      const Sums own = pixel;
      pixel += from_before[k] + from_behind;
      if (k > 0) from_behind = decay * passes[(k - 1) * step] * (from_behind + own);
    }
  }

  template <typename Sums>
  void SumRows(float decay, std::vector<Sums>* line, std::vector<Sums>* sums) const {
    for (int y = 0; y < height_; ++y) {
      const size_t first = static_cast<size_t>(y) * width_;
      SumAlong(&right_[first], width_, 1, decay, line, &(*sums)[first]);
    }
  }

  template <typename Sums>
  void SumColumns(float decay, std::vector<Sums>* line, std::vector<Sums>* sums) const {
    for (int x = 0; x < width_; ++x) {
      SumAlong(&down_[x], height_, width_, decay, line, &(*sums)[x]);
    }
  }

  int width_, height_;
  // [height][width] The share of the weight that changes of colour leave on the way from a pixel to
  // its right and its lower neighbour.
  std::vector<float> right_, down_;
};

// Returns the largest change of display values from pixel to pixel that the noise of a photo makes,
// by what changes in its plainest parts.
double PhotoNoise(const StereoView& view);

}  // namespace semfoam
