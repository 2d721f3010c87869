// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

#include <cstdint>
#include <filesystem>

namespace semfoam {

struct PhotoSize {
  // In pixels.
  int width = 0;
  int height = 0;

  bool operator==(const PhotoSize&) const = default;
};

// Returns whether two sizes can be those of one picture at two resolutions, each side rounded to
// whole pixels.
bool SameAspect(const PhotoSize& a, const PhotoSize& b);

// Returns the size of a photo reduced to a longest side of `max_image_size` pixels, by COLMAP's
// rule; the same size if the photo is not larger, or if max_image_size is 0 or less.
PhotoSize ReducedSize(const PhotoSize& size, int max_image_size);

// Reduces a photo to a smaller (or the same) size: each pixel is the mean, in linear light, of the
// area that it covers. CHECKs that neither side grows and that both sizes have a pixel.
Image8 ReducePhoto(const Image8& photo, const PhotoSize& size);

// The content of a photo's header.
struct PhotoHeader {
  PhotoSize size;
  // Peak memory of ReadPhoto in bytes, with its result.
  uint64_t decoding_bytes = 0;
};

// Reads the header without decoding a pixel. Throws UserError, one sentence naming the file, when
// it is missing, is no image, has more than kMostChannels channels, or its header promises more
// pixels than its bytes could ever hold.
PhotoHeader ReadPhotoHeader(const std::filesystem::path& path);
PhotoSize ReadPhotoSize(const std::filesystem::path& path);

// Reads a photo as display values, 8-bit RGB, from any integer format that OpenImageIO reads: 16
// bits are rounded to 8, grey is copied to all channels, transparency is composited over white (the
// background of training). Like COLMAP, does not apply an EXIF orientation. Throws UserError as
// ReadPhotoHeader does, when the file does not fit into memory, when it cannot be decoded
// completely and without a warning of the decoder (to which a cut JPEG is only a warning), or when
// it holds floating-point values, which are no display values.
Image8 ReadPhoto(const std::filesystem::path& path);

// Maximum number of channels: cameras for remote sensing have a dozen bands. Channels other than
// the first three and alpha are ignored.
inline constexpr int kMostChannels = 16;

// Maximum ratio of the pixels' bytes to the file's bytes of a PNG: deflate compresses at most 1032
// to 1, so a header that promises more is wrong.
inline constexpr uint64_t kMostPngExpansion = 1100;

// The size of a picture that its header claims.
struct PictureClaim {
  int width = 0;
  int height = 0;
  int depth = 1;
  int channels = 0;
};

// Throws UserError, one sentence naming the file, where the file cannot hold a picture of this
// size, or the picture has more than kMostChannels channels. Must be called before memory is
// allocated for its pixels.
void RequirePlausible(const std::filesystem::path& path, const PictureClaim& claim);

// Throws UserError, one sentence naming the file, where decoding a picture of this size takes more
// memory than is available.
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
