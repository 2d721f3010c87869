// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/class_image.h"

namespace semfoam {

ClassImage::ClassImage(size_t num_pixels, int num_classes) {
  if (BytesPerPixel(num_classes) == 1) {
    narrow_.assign(num_pixels, kNarrowNone);
  } else {
    wide_.assign(num_pixels, kWideNone);
  }
}

void ClassImage::Widen(int num_classes) {
  if (narrow_.empty() || BytesPerPixel(num_classes) == 1) return;
  wide_.reserve(narrow_.size());
  for (const uint8_t c : narrow_) wide_.push_back(c == kNarrowNone ? kWideNone : c);
  narrow_ = {};
}

ClassImage ClassesOf(const ClassImage& indices,
                     const std::vector<int32_t>& classes,
                     int num_classes) {
  ClassImage image(indices.NumPixels(), num_classes);
  for (size_t i = 0; i < indices.NumPixels(); ++i) image.Set(i, classes[indices[i]]);
  return image;
}

}  // namespace semfoam
