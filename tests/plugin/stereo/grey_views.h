// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/random.h"
#include "plugin/stereo/stereo_view.h"

#include <Eigen/Core>

namespace semfoam {

// Grey views whose pixels are given by a function.

// Returns a view without pixels, its principal point in the middle, that looks along z from the
// origin.
inline StereoView PinholeView(int index, int width, int height, double focal) {
  StereoView view;
  view.view = index;
  view.width = width;
  view.height = height;
  view.focal.setConstant(focal);
  view.center = {0.5 * width, 0.5 * height};
  return view;
}

// Appends the display values value(x, y), row by row.
template <typename Value>
void AddPixels(const Value& value, StereoView* view) {
  for (int y = 0; y < view->height; ++y) {
    for (int x = 0; x < view->width; ++x) {
      const auto grey = static_cast<float>(value(x, y));
      view->grey.push_back(grey - 0.5f);
      view->color.push_back(Eigen::Vector3f::Constant(grey));
    }
  }
}

// Appends the display values light(ray) of the pixels' rays (StereoView::RayThrough), row by row,
// with normal noise of this standard deviation.
template <typename Light>
void AddPixelsOfRays(const Light& light, double noise, StereoView* view) {
  CounterRandom random(5, 0x11, view->view);
  const auto value = [&](int x, int y) {
    return light(view->RayThrough({x + 0.5, y + 0.5})) + noise * random.Normal();
  };
  AddPixels(value, view);
}

}  // namespace semfoam
