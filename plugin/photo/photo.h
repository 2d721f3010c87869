// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

#include <cstdint>
#include <filesystem>

namespace semfoam {

struct PhotoSize {
  int width = 0;  // pixels
  int height = 0;

  bool operator==(const PhotoSize&) const = default;
};

// Whether both sizes are one picture at two resolutions, each side rounded to whole pixels.
bool SameAspect(const PhotoSize& a, const PhotoSize& b);

// The size of a photo whose longest side is brought down to `max_image_size` pixels, as COLMAP does
// it: the same where it has no more, or where max_image_size is 0 or less.
PhotoSize ReducedSize(const PhotoSize& size, int max_image_size);

// The photo at a smaller (or the same) size: a pixel is the mean, in linear light, of the area that
// it covers. CHECKs that neither side grows and that there is a pixel.
Image8 ReducePhoto(const Image8& photo, const PhotoSize& size);

// What a photo's header says.
struct PhotoHeader {
  PhotoSize size;
  uint64_t decoding_bytes = 0;  // memory that ReadPhoto takes at its peak, with its result
};

// Reads the header without decoding a pixel. Throws UserError, one sentence naming the file, when
// it is missing, is no image, has more than kMostChannels channels, or its header promises more
// pixels than its bytes could ever hold.
PhotoHeader ReadPhotoHeader(const std::filesystem::path& path);
PhotoSize ReadPhotoSize(const std::filesystem::path& path);

// A photo as display values, 8-bit RGB, of any integer format that OpenImageIO reads: 16 bits are
// rounded to 8, grey is spread, transparency is laid over white (the background of training). The
// pixels stay as they are stored: an EXIF orientation is not applied, as COLMAP does not. Throws
// UserError as ReadPhotoHeader does, and when there is not the memory to decode the file, when it
// cannot be decoded, completely and without one complaint of the decoder's (a cut JPEG is only a
// warning to it), or holds floating-point values, which are no display values.
Image8 ReadPhoto(const std::filesystem::path& path);

// Cameras for remote sensing have a dozen bands. Beyond the first three and alpha none is looked
// at.
inline constexpr int kMostChannels = 16;

// Deflate packs at most 1032 bytes into one: a PNG's header that promises more than this many times
// the file's bytes is wrong.
inline constexpr uint64_t kMostPngExpansion = 1100;

// What a picture's header promises, whatever reads it.
struct PictureClaim {
  int width = 0;
  int height = 0;
  int depth = 1;
  int channels = 0;
};

// Throws UserError, one sentence naming the file, where no picture of this size can be in the file,
// or it has more than kMostChannels channels. To be called before memory is taken for its pixels.
void RequirePlausible(const std::filesystem::path& path, const PictureClaim& claim);

// Throws UserError, one sentence naming the file, where so many bytes, which decoding a picture of
// this size takes, are more than the memory that is available.
void RequireDecodingMemory(const std::filesystem::path& path,
                           const PhotoSize& size,
                           uint64_t bytes);
void RequireDecodingMemory(const std::filesystem::path& path,
                           const PhotoSize& size,
                           uint64_t bytes,
                           int64_t available);

// Walks over the chunks of a PNG file and checks their lengths and checksums up to the last one.
// Throws UserError when the file is cut or damaged. Does nothing for files that are no PNG. The
// decoders do not notice a missing end after the last pixel.
void CheckPngChunks(const std::filesystem::path& path);

}  // namespace semfoam
