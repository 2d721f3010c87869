// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ids.h"
#include "plugin/photo/photo.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace semfoam {

// A photo's mask in memory: an index for every pixel, in as few bytes as the number of different
// ones allows.

// Maximum number of classes of a ClassImage, and so of a set of masks.
inline constexpr size_t kMaxMaskClasses = 65535;

// An index of every pixel of a photo, row-major. `Index` is an enum of int32_t; -1 is none.
template <typename Index>
class IndexImage {
 public:
  static constexpr Index kNone{-1};

  // Makes an image without pixels: that of a photo without a mask.
  IndexImage() = default;
  // Makes an image whose pixels are all kNone.
  IndexImage(PhotoSize size, int num_indices) : IndexImage(NumPixelsOf(size), num_indices) {}
  IndexImage(size_t num_pixels, int num_indices);

  bool Empty() const { return NumPixels() == 0; }
  size_t NumPixels() const { return narrow_.empty() ? wide_.size() : narrow_.size(); }

  // Returns the index of pixel y * width + x, or kNone.
  Index operator[](size_t pixel) const {
    if (!narrow_.empty()) return narrow_[pixel] == kNarrowNone ? kNone : Index{narrow_[pixel]};
    return wide_[pixel] == kWideNone ? kNone : Index{wide_[pixel]};
  }
  void Set(size_t pixel, Index index) {
    if (!narrow_.empty()) {
      narrow_[pixel] = index < Index{0} ? kNarrowNone : static_cast<uint8_t>(index);
    } else {
      wide_[pixel] = index < Index{0} ? kWideNone : static_cast<uint16_t>(index);
    }
  }

  // Starts to load the index of this pixel into the CPU's cache.
  void Prefetch(size_t pixel) const {
    if (!narrow_.empty()) {
      __builtin_prefetch(narrow_.data() + pixel);
    } else {
      __builtin_prefetch(wide_.data() + pixel);
    }
  }

  // Raises the number of indices that the image can hold; pixels keep their indices.
  void Widen(int num_indices);

  // Returns the bytes that each pixel takes with this many indices.
  static int BytesPerPixel(int num_indices) { return num_indices <= kNarrowNone ? 1 : 2; }

 private:
  static size_t NumPixelsOf(PhotoSize size) {
    return static_cast<size_t>(size.width) * static_cast<size_t>(size.height);
  }

  static constexpr uint8_t kNarrowNone = 0xff;
  static constexpr uint16_t kWideNone = 0xffff;
  // One of the two is empty.
  std::vector<uint8_t> narrow_;
  std::vector<uint16_t> wide_;
};

// The class of every pixel; kNone is kUnlabelled.
using ClassImage = IndexImage<ClassIndex>;

// A mask's own ids by their place in MaskContents::ids, before they are numbered as classes.
enum class IdIndex : int32_t {};
using IdImage = IndexImage<IdIndex>;

// Replaces the indices of a mask's ids, none of which is kNone, by classes: `classes` [ids of the
// mask] are less than `num_classes`, or kUnlabelled.
ClassImage ClassesOf(const IdImage& indices,
                     const std::vector<ClassIndex>& classes,
                     int num_classes);

}  // namespace semfoam
