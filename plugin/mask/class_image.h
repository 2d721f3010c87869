// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "plugin/photo/photo.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace semfoam {

// A photo's mask in memory: the class of every pixel in as few bytes as the number of classes
// allows.

// Maximum number of classes of a ClassImage, and so of a set of masks.
inline constexpr size_t kMaxMaskClasses = 65535;

// The class of every pixel of a photo, row-major.
class ClassImage {
 public:
  // Makes an image without pixels: that of a photo without a mask.
  ClassImage() = default;
  // Makes an image whose pixels are all kUnlabelled.
  ClassImage(PhotoSize size, int num_classes) : ClassImage(NumPixelsOf(size), num_classes) {}
  ClassImage(size_t num_pixels, int num_classes);

  bool Empty() const { return NumPixels() == 0; }
  size_t NumPixels() const { return narrow_.empty() ? wide_.size() : narrow_.size(); }

  // Returns the class of pixel y * width + x, or kUnlabelled.
  int32_t operator[](size_t pixel) const {
    if (!narrow_.empty()) return narrow_[pixel] == kNarrowNone ? kUnlabelled : narrow_[pixel];
    return wide_[pixel] == kWideNone ? kUnlabelled : wide_[pixel];
  }
  void Set(size_t pixel, int32_t class_index) {
    if (!narrow_.empty()) {
      narrow_[pixel] = class_index < 0 ? kNarrowNone : static_cast<uint8_t>(class_index);
    } else {
      wide_[pixel] = class_index < 0 ? kWideNone : static_cast<uint16_t>(class_index);
    }
  }

  // Raises the number of classes that the image can hold; pixels keep their classes.
  void Widen(int num_classes);

  // Returns the bytes that each pixel takes with this many classes.
  static int BytesPerPixel(int num_classes) { return num_classes <= kNarrowNone ? 1 : 2; }

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

// Replaces the indices of a mask's ids (DecodedMask::indices), none of which is kUnlabelled, by
// classes: `classes` [ids of the mask] are less than `num_classes`, or kUnlabelled.
ClassImage ClassesOf(const ClassImage& indices,
                     const std::vector<int32_t>& classes,
                     int num_classes);

}  // namespace semfoam
