// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Superpixels: connected pieces of a photo of about one colour.

// A line between two of them.
struct SuperpixelBorder {
  int32_t a = 0;
  int32_t b = 0;  // > a
  // Pairs of neighbouring pixels on its two sides.
  int32_t length = 0;
};

struct Superpixels {
  int width = 0;
  int height = 0;
  // [height][width] The superpixel of each pixel.
  std::vector<int32_t> of_pixel;
  // [superpixels] In pixels.
  std::vector<int32_t> areas;
  // [superpixels] Mean colours in CIELAB (D65), L from 0 to 100.
  std::vector<Eigen::Vector3f> colors;
  // Ascending by a and b.
  std::vector<SuperpixelBorder> borders;
};

// Divides a photo of at least one pixel by SLIC (Achanta et al., "SLIC superpixels compared to
// state-of-the-art superpixel methods", 2012), with centres `spacing` pixels apart; every connected
// piece counts on its own. Noise is smoothed before, but not across edges.
Superpixels DivideIntoSuperpixels(const Image8& photo, int spacing);

}  // namespace semfoam
