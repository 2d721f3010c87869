// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

namespace semfoam {

// Images out, each written beside its target and renamed into place; parent folders are made. All
// throw UserError naming the file where it cannot be written. PNG and EXR files carry a mark by
// which IsOwnImage knows them.

// 8-bit RGB PNG, display values.
void WriteRgbPng(const std::filesystem::path& path, const Image8& image);

// 16-bit grey PNG whose values are the label ids. CHECKs that they fit, 0..65535.
void WriteLabelPng(const std::filesystem::path& path, const LabelImage& labels);

// Float EXR of one channel, row-major [height][width].
void WriteDepthExr(const std::filesystem::path& path,
                   int width,
                   int height,
                   const std::vector<float>& depth);

// Whether `path` is an image that WriteRgbPng, WriteLabelPng or WriteDepthExr has written, by its
// mark; false where there is no image that can be read.
bool IsOwnImage(const std::filesystem::path& path);

// An animated GIF that begins anew at its end; all images of one size. Only the compressed images
// are kept, so that no animation is too long. Without Finish there is no file.
class GifWriter {
 public:
  GifWriter(const std::filesystem::path& path, double frames_per_second);
  ~GifWriter();

  void Add(const Image8& image);
  // CHECKs that there was an image.
  void Finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// A mask as it is used for scoring: 1 where the object is, else 0.
struct Foreground {
  LabelImage mask;
  int largest = 0;  // of the values in the first channel of the file
  int white = 255;  // the largest value that the file can hold, 255 or 65535
};

// The object is where the first channel of the image is above 128 of 255; in a file whose largest
// value is 1, where that is. Throws UserError where the file is missing or damaged.
Foreground ReadForeground(const std::filesystem::path& path);

// Nearest neighbour, pixel (x, y) of the result from (floor(x * sx), floor(y * sy)) of the input,
// sx and sy being the ratios of the sizes.
LabelImage ResizeNearest(const LabelImage& image, int width, int height);

}  // namespace semfoam
