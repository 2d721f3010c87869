// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/metrics.h"

#include <filesystem>

namespace semfoam {

struct PhotoSize {
  int width = 0;  // pixels
  int height = 0;

  bool operator==(const PhotoSize&) const = default;
};

// Whether both sizes are one picture at two resolutions, each side rounded to whole pixels.
bool SameAspect(const PhotoSize& a, const PhotoSize& b);

// The size of a photo as its header says it, without decoding. Throws UserError, one sentence
// naming the file, when it is missing, is no image, or its header promises more pixels than its
// bytes could ever hold.
PhotoSize ReadPhotoSize(const std::filesystem::path& path);

// A photo as display values, 8-bit RGB, of any integer format that OpenImageIO reads: 16 bits are
// rounded to 8, grey is spread, transparency is laid over white (the background of training). The
// pixels stay as they are stored: an EXIF orientation is not applied, as COLMAP does not. Throws
// UserError, one sentence naming the file, when the file cannot be decoded, completely and without
// one complaint of the decoder's (a cut JPEG is only a warning to it), or holds floating-point
// values, which are no display values.
Image8 ReadPhoto(const std::filesystem::path& path);

// Walks over the chunks of a PNG file and checks their lengths and checksums up to the last one.
// Throws UserError when the file is cut or damaged. Does nothing for files that are no PNG. The
// decoders do not notice a missing end after the last pixel.
void CheckPngChunks(const std::filesystem::path& path);

}  // namespace semfoam
