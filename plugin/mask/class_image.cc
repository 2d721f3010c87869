// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/class_image.h"

namespace semfoam {

template <typename Index>
IndexImage<Index>::IndexImage(size_t num_pixels, int num_indices) {
  if (BytesPerPixel(num_indices) == 1) {
    narrow_.assign(num_pixels, kNarrowNone);
  } else {
    wide_.assign(num_pixels, kWideNone);
  }
}

template <typename Index>
void IndexImage<Index>::Widen(int num_indices) {
  if (narrow_.empty() || BytesPerPixel(num_indices) == 1) return;
  wide_.reserve(narrow_.size());
  for (const uint8_t c : narrow_) wide_.push_back(c == kNarrowNone ? kWideNone : c);
  narrow_ = {};
}

template class IndexImage<ClassIndex>;
template class IndexImage<IdIndex>;

ClassImage ClassesOf(const IdImage& indices,
                     const std::vector<ClassIndex>& classes,
                     int num_classes) {
  ClassImage image(indices.NumPixels(), num_classes);
  for (size_t i = 0; i < indices.NumPixels(); ++i) {
    image.Set(i, classes[static_cast<size_t>(indices[i])]);
  }
  return image;
}

}  // namespace semfoam
