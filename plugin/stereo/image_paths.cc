// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/image_paths.h"

#include <algorithm>
#include <cmath>

namespace semfoam {
namespace {

// The largest change from pixel to pixel that noise makes is so many times the lower quartile of a
// photo's changes, which are those of its plainest parts: of Gaussian noise, in the channel of the
// largest change, nine tenths lie below. A photo that has texture all over has no plain parts, so
// there is a bound, of display values.
constexpr double kNoiseOverQuartile = 2.5, kMostNoise = 0.03;

float ChangeBetween(const StereoView& view, size_t i, size_t j) {
  return (view.color[i] - view.color[j]).cwiseAbs().maxCoeff();
}

// Luma of display values, less 0.5, from which on a pixel is taken for white that is cut off.
constexpr float kCutOff = 0.48f;

// Returns whether the photo shows something at a pixel: false where it is cut off, too.
bool IsShown(const StereoView& view, size_t i) { return view.grey[i] < kCutOff; }

}  // namespace

ImagePaths::ImagePaths(const StereoView& view, double color_reach, double free_change)
    : width_(view.width),
      height_(view.height),
      right_(view.NumPixels(), 0.f),
      down_(view.NumPixels(), 0.f) {
  const auto pass = [&](size_t i, size_t j) {
    // Nothing passes where the photo shows nothing: edges are lost where light is cut off.
    if (!IsShown(view, i) || !IsShown(view, j)) return 0.f;
    const double change = std::max(0.0, ChangeBetween(view, i, j) - free_change);
    return static_cast<float>(std::exp(-change / color_reach));
  };
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const size_t i = static_cast<size_t>(y) * width_ + x;
      if (x + 1 < width_) right_[i] = pass(i, i + 1);
      if (y + 1 < height_) down_[i] = pass(i, i + width_);
    }
  }
}

double PhotoNoise(const StereoView& view) {
  std::vector<float> changes;
  changes.reserve(view.NumPixels());
  for (size_t i = 0; i + 1 < view.NumPixels(); ++i) {
    if (IsShown(view, i) && IsShown(view, i + 1)) changes.push_back(ChangeBetween(view, i, i + 1));
  }
  if (changes.empty()) return 0;
  const auto quartile = changes.begin() + static_cast<ptrdiff_t>(changes.size() / 4);
  std::nth_element(changes.begin(), quartile, changes.end());
  return std::min(kMostNoise, kNoiseOverQuartile * *quartile);
}

}  // namespace semfoam
