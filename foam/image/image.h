// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

namespace semfoam {

// An 8-bit RGB image, display values, row-major, interleaved: [height][width][3].
struct Image8 {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> data;
};

// An image of label ids, row-major: [height][width]. 0 = none.
struct LabelImage {
  int width = 0;
  int height = 0;
  std::vector<int32_t> data;
};

}  // namespace semfoam
