// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask/class_image.h"
#include "plugin/photo/photo.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace semfoam {

// Decodes one mask, a PNG whose pixels hold the ids of objects, such as DEVA writes, at the size of
// its photo. The classes of the ids depend on all masks of a set (mask_classes.h).

// The contents of a mask before its ids are numbered as classes.
struct MaskContents {
  // Whether it stores colours; false: grey values or palette indices.
  bool is_rgb = false;
  // Every value that occurs, in the order of first occurrence; MaskClasses interprets them.
  std::vector<uint32_t> ids;
  // Number of pixels of id 0, at the mask's size.
  int64_t num_zero = 0;
  // Size of the file; 0 x 0 where there is no mask.
  PhotoSize size;
};

struct DecodedMask {
  MaskContents contents;
  // At the photo's size, read at the nearest pixel centre: indices into contents.ids, never
  // kNone. One byte a pixel of the photo up to 255 ids, else two.
  IdImage indices;
};

// Decodes a mask. Takes MaskHeader::decoding_bytes of memory in addition to the result. Throws
// UserError, one sentence naming the file: a mask that is damaged or no PNG; one whose aspect is
// not the photo's (to a pixel); one with more than kMaxMaskClasses ids; interlaced rows that do not
// fit into memory.
DecodedMask DecodeMask(const std::filesystem::path& path, const PhotoSize& photo_size);

// Returns the pixel of a mask in which the centre of a photo's pixel falls, along one axis of
// `mask` and `photo` pixels: floor((i + 1/2) mask / photo).
inline int64_t MaskPixel(int64_t i, int mask, int photo) {
  return (2 * i + 1) * mask / (2 * int64_t{photo});
}

// Throws UserError naming the file where the mask's aspect is not the photo's, to a pixel.
void RequireAspect(const std::filesystem::path& path,
                   const PhotoSize& mask,
                   const PhotoSize& photo);

// Decodes a mask that had `contents` when it was decoded before. Throws UserError also where its
// ids have changed.
DecodedMask DecodeMaskAgain(const std::filesystem::path& path,
                            const PhotoSize& photo_size,
                            const MaskContents& contents);

}  // namespace semfoam
