// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_decoding.h"

#include "foam/util/error.h"
#include "plugin/mask/mask_png.h"

#include <span>
#include <unordered_map>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Finds the place of each value in the order of their first occurrence.
class IdTable {
 public:
  IdTable(const fs::path& path, MaskContents* contents) : path_(path), contents_(*contents) {}

  uint16_t IndexOf(uint32_t value) {
    // Masks are runs of one value: most pixels need no look-up.
    if (contents_.ids.empty() || value != last_value_) {
      const auto [entry, is_new] =
          index_of_.try_emplace(value, static_cast<uint16_t>(contents_.ids.size()));
      if (is_new) Add(value);
      last_value_ = value;
      last_index_ = entry->second;
    }
    return last_index_;
  }

 private:
  void Add(uint32_t value) {
    if (contents_.ids.size() == kMaxMaskClasses) {
      throw UserError(path_.string(),
                      ": has more than ",
                      kMaxMaskClasses,
                      " ids, where one for each object would be right; is it a photo, or a "
                      "resampled mask?");
    }
    contents_.ids.push_back(value);
  }

  const fs::path& path_;
  MaskContents& contents_;
  std::unordered_map<uint32_t, uint16_t> index_of_;
  uint32_t last_value_ = 0;
  uint16_t last_index_ = 0;
};

}  // namespace

void RequireAspect(const fs::path& path, const PhotoSize& mask, const PhotoSize& photo) {
  if (SameAspect(mask, photo)) return;
  throw UserError(path.string(),
                  ": is ",
                  mask.width,
                  " x ",
                  mask.height,
                  " pixels and its photo ",
                  photo.width,
                  " x ",
                  photo.height,
                  "; a mask of the photo's aspect would be right, by mask_undistorter if COLMAP "
                  "undistorted the photo.");
}

DecodedMask DecodeMask(const fs::path& path, const PhotoSize& photo_size) {
  DecodedMask mask;
  mask.indices = IdImage(photo_size, /*num_indices=*/1);
  IdTable table(path, &mask.contents);
  std::vector<int64_t> columns(photo_size.width);
  std::vector<uint16_t> row;
  int64_t photo_y = 0;
  size_t pixel = 0;
  const MaskHeader header =
      ReadMaskRows(path, [&](const MaskHeader& header, int y, std::span<const uint32_t> values) {
        if (y == 0) {
          row.resize(values.size());
          for (int x = 0; x < photo_size.width; ++x) {
            columns[x] = MaskPixel(x, header.size.width, photo_size.width);
          }
        }
        for (size_t x = 0; x < values.size(); ++x) {
          row[x] = table.IndexOf(values[x]);
          mask.contents.num_zero += values[x] == 0;
        }
        mask.indices.Widen(static_cast<int>(mask.contents.ids.size()));
        for (; photo_y < photo_size.height &&
               MaskPixel(photo_y, header.size.height, photo_size.height) == y;
             ++photo_y) {
          for (const int64_t x : columns) mask.indices.Set(pixel++, IdIndex{row[x]});
        }
      });
  mask.contents.size = header.size;
  mask.contents.is_rgb = header.is_rgb;
  RequireAspect(path, header.size, photo_size);
  return mask;
}

DecodedMask DecodeMaskAgain(const fs::path& path,
                            const PhotoSize& photo_size,
                            const MaskContents& contents) {
  DecodedMask mask = DecodeMask(path, photo_size);
  if (mask.contents.ids == contents.ids) return mask;
  throw UserError(path.string(),
                  ": has changed its ids since it was first looked at; masks that stay as they are "
                  "would be right.");
}

}  // namespace semfoam
