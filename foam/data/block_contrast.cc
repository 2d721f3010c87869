// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/data/block_contrast.h"

#include <algorithm>
#include <cmath>

namespace semfoam {

BlockContrast::BlockContrast(const Image8& photo, const std::function<bool(int x, int y)>& counts)
    : across_(static_cast<int>(Blocks(photo.width))) {
  contrast_.reserve(Bytes(photo.width, photo.height));
  for (int y0 = 0; y0 < photo.height; y0 += kSide) {
    for (int x0 = 0; x0 < photo.width; x0 += kSide) {
      // Integers, so that a plain block has the variance 0 exactly.
      int64_t num = 0, sum[3] = {}, squares[3] = {};
      for (int y = y0; y < std::min(y0 + kSide, photo.height); ++y) {
        for (int x = x0; x < std::min(x0 + kSide, photo.width); ++x) {
          if (counts && !counts(x, y)) continue;
          const uint8_t* const rgb =
              photo.data.data() + 3 * (static_cast<size_t>(y) * photo.width + x);
          ++num;
          for (int c = 0; c < 3; ++c) {
            sum[c] += rgb[c];
            squares[c] += rgb[c] * rgb[c];
          }
        }
      }
      int64_t variance = 0;  // of all channels, times num^2
      for (int c = 0; c < 3; ++c) variance += num * squares[c] - sum[c] * sum[c];
      const double deviation = num > 0 ? std::sqrt(variance / 3.0) / num / 255 : 0;
      contrast_.push_back(static_cast<uint8_t>(std::lround(deviation * kUnits)));
    }
  }
}

}  // namespace semfoam
