// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace semfoam {

// Writes and reads image files. Each file is written beside its target and renamed into place;
// parent folders are created. All functions throw UserError naming the file where it cannot be
// written. PNG and EXR files contain a mark that IsOwnImage recognises.

// Writes an 8-bit RGB PNG, display values.
void WriteRgbPng(const std::filesystem::path& path, const Image8& image);

// Returns the bytes of an 8-bit RGB PNG and of a JPEG of this quality, 1 to 100, display values,
// without writing a file. Same image, same bytes.
std::string EncodePng(const Image8& image);
std::string EncodeJpeg(const Image8& image, int quality);

// Writes a float EXR of one channel, row-major [height][width].
void WriteDepthExr(const std::filesystem::path& path,
                   int width,
                   int height,
                   const std::vector<float>& depth);

// Returns whether `path` is an image that WriteRgbPng, WriteDepthExr or
// WriteLabelPng (plugin/mask/label_png.h) has written,
// by its mark; false where there is no readable image.
bool IsOwnImage(const std::filesystem::path& path);

// Writes an animated GIF that loops; all images have the same size. Keeps only the compressed
// images, so that long animations fit into memory. Without Finish there is no file.
class GifWriter {
 public:
  GifWriter(const std::filesystem::path& path, double frames_per_second);
  ~GifWriter();

  void Add(const Image8& image);
  // Writes the file. CHECKs that there was an image.
  void Finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// A mask for scoring: 1 for the object, else 0.
struct Foreground {
  LabelImage mask;
  // Largest value in the first channel of the file.
  int largest = 0;
  // Largest value that the file can hold, 255 or 65535.
  int white = 255;
};

// Reads a mask: the object is where the first channel of the image is above 128 of 255; in a file
// whose largest value is 1, where the value is 1. Throws UserError where the file is missing or
// damaged.
Foreground ReadForeground(const std::filesystem::path& path);

// Resizes an image by nearest neighbour: pixel (x, y) of the result is pixel (floor(x * sx),
// floor(y * sy)) of the input, where sx and sy are the ratios of the sizes.
LabelImage ResizeNearest(const LabelImage& image, int width, int height);

}  // namespace semfoam
