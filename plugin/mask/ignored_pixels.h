// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photo/photo.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace semfoam {

// The pixels of a photo that a binary mask of photogrammetry excludes. In memory: the ends of runs,
// four bytes each, and four bytes a row.
class IgnoredPixels {
 public:
  // Excludes nothing.
  IgnoredPixels() = default;
  explicit IgnoredPixels(int width) : width_(width) {}

  // Appends a row from the top one on: `ignored` [width] tells of each pixel.
  void AddRow(const std::vector<bool>& ignored);

  // Whether the pixel is excluded. Rows that were not added have no excluded pixels.
  bool Contains(int x, int y) const;
  int64_t NumPixels() const;

 private:
  int width_ = 0;
  // Columns where a row changes from kept to excluded or back, ascending, row after row; rows begin
  // as kept.
  std::vector<uint32_t> changes_;
  // [rows] One past the last change of each.
  std::vector<uint32_t> row_ends_;
};

// Reads a mask as photogrammetry programs write it, at the size of its photo (of each pixel, the
// mask's at the nearest centre): black (0) is excluded, as in COLMAP and Metashape, or with
// `inverted` all else. In an image with an alpha channel it is the alpha that counts. Throws
// UserError, one sentence naming the file, where it is damaged, no PNG or of another aspect.
IgnoredPixels ReadIgnoredPixels(const std::filesystem::path& path,
                                const PhotoSize& photo_size,
                                bool inverted);

}  // namespace semfoam
