// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/plane_sweep.h"
#include "plugin/stereo/stereo_view.h"

#include <cstddef>
#include <functional>

#include "tests/plugin/stereo/grey_views.h"

namespace semfoam {

// Small grey views and depth maps by functions of the pixel.

inline constexpr int kWidth = 60, kHeight = 40;

using Colors = std::function<float(int x, int y)>;
using Depths = std::function<double(int x, int y)>;

inline StereoView ViewOf(const Colors& color) {
  StereoView view;
  view.width = kWidth;
  view.height = kHeight;
  AddPixels(color, &view);
  return view;
}

inline DepthMap MapOf(const Depths& inverse) {
  DepthMap map;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) map.inverse.push_back(static_cast<float>(inverse(x, y)));
  }
  return map;
}

inline float At(const DepthMap& map, int x, int y) {
  return map.inverse[static_cast<size_t>(y) * kWidth + x];
}

inline float Grey(int, int) { return 0.5f; }

}  // namespace semfoam
