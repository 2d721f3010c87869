// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/ignored_pixels.h"

#include "plugin/mask/mask_decoding.h"
#include "plugin/mask/mask_png.h"

#include <algorithm>
#include <span>

#include <glog/logging.h>

namespace semfoam {

void IgnoredPixels::AddRow(const std::vector<bool>& ignored) {
  CHECK_EQ(static_cast<int>(ignored.size()), width_);
  bool is_ignored = false;
  for (int x = 0; x < width_; ++x) {
    if (ignored[x] == is_ignored) continue;
    is_ignored = !is_ignored;
    changes_.push_back(static_cast<uint32_t>(x));
  }
  row_ends_.push_back(static_cast<uint32_t>(changes_.size()));
}

bool IgnoredPixels::Contains(int x, int y) const {
  if (y < 0 || y >= static_cast<int>(row_ends_.size())) return false;
  const auto begin = changes_.begin() + (y == 0 ? 0 : row_ends_[y - 1]);
  const auto end = changes_.begin() + row_ends_[y];
  return (std::upper_bound(begin, end, static_cast<uint32_t>(x)) - begin) % 2 == 1;
}

int64_t IgnoredPixels::NumPixels() const {
  int64_t count = 0;
  uint32_t begin = 0;
  for (const uint32_t end : row_ends_) {
    for (uint32_t i = begin; i < end; i += 2) {
      count += (i + 1 < end ? changes_[i + 1] : static_cast<uint32_t>(width_)) - changes_[i];
    }
    begin = end;
  }
  return count;
}

IgnoredPixels ReadIgnoredPixels(const std::filesystem::path& path,
                                const PhotoSize& photo_size,
                                bool inverted) {
  IgnoredPixels pixels(photo_size.width);
  std::vector<bool> row(photo_size.width);
  int64_t photo_y = 0;
  const MaskHeader header = ReadAlphaOrIdRows(
      path, [&](const MaskHeader& header, int y, std::span<const uint32_t> values) {
        if (y == 0) RequireAspect(path, header.size, photo_size);
        if (MaskPixel(photo_y, header.size.height, photo_size.height) != y) return;
        for (int x = 0; x < photo_size.width; ++x) {
          row[x] = (values[MaskPixel(x, header.size.width, photo_size.width)] == 0) != inverted;
        }
        for (; photo_y < photo_size.height &&
               MaskPixel(photo_y, header.size.height, photo_size.height) == y;
             ++photo_y) {
          pixels.AddRow(row);
        }
      });
  CHECK_EQ(photo_y, photo_size.height) << header.size.height;
  return pixels;
}

}  // namespace semfoam
