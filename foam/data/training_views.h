// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ids.h"

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// One pixel of a photo as a ray with its targets.
struct TrainingRay {
  Eigen::Vector3f direction;  // unit length
  Eigen::Vector3f color;      // display values (sRGB / 255), 0..1
  // Class of the pixel, or kUnlabelled: trains colour, not identity.
  ClassIndex class_index = kUnlabelled;
};

// What a photo and its mask store of one pixel: what is kept of photos that do not all fit into
// memory. No padding, as there may be hundreds of millions of them.
struct PixelValue {
  uint8_t color[3];        // RGB
  uint8_t class_bytes[2];  // the class, low byte first; 0xffff = kUnlabelled

  void SetClass(ClassIndex class_index) {
    const auto value =
        static_cast<uint16_t>(class_index == kUnlabelled ? 0xffff : Value(class_index));
    class_bytes[0] = static_cast<uint8_t>(value & 0xff);
    class_bytes[1] = static_cast<uint8_t>(value >> 8);
  }
  ClassIndex Class() const {
    const int32_t value = class_bytes[0] | class_bytes[1] << 8;
    return value == 0xffff ? kUnlabelled : ClassIndex{value};
  }
};
static_assert(sizeof(PixelValue) == 5);

// The pixels of one view, decoded for as long as this lives.
class ViewPixels {
 public:
  virtual ~ViewPixels() = default;
  virtual PixelValue At(int x, int y) const = 0;
};

// The photos as the trainer sees them: rays in the normalised frame, made on the fly from (view,
// pixel); colour and class of a pixel come from the same call, so they cannot drift apart.
// Thread-safe: all calls are const.
//
// Views that do not fit into memory (HoldsPixels is false) are read one after the other: the
// trainer knows which pixels it will draw, and keeps just these (pixel_cache.h).
class TrainingViews {
 public:
  virtual ~TrainingViews() = default;

  virtual int NumViews() const = 0;
  virtual int Width(int view) const = 0;
  virtual int Height(int view) const = 0;
  virtual bool IsHeldOut(int view) const = 0;
  virtual Eigen::Vector3d Origin(int view) const = 0;  // camera centre, normalised frame

  // The ray through the centre of pixel (x, y), that is through (x + 0.5, y + 0.5). False where the
  // camera model has no ray for the pixel (its distortion cannot be inverted there).
  // CHECKs HoldsPixels().
  virtual bool Ray(int view, int x, int y, TrainingRay* ray) const = 0;

  // The direction of that ray, for which no pixel need be in memory.
  virtual bool RayDirection(int view, int x, int y, Eigen::Vector3f* direction) const {
    TrainingRay ray;
    if (!Ray(view, x, y, &ray)) return false;
    *direction = ray.direction;
    return true;
  }

  // Whether all pixels are in memory. Views of which this is false implement what follows.
  virtual bool HoldsPixels() const { return true; }
  // What pixels that are kept may take of memory, in bytes, all together.
  virtual int64_t CacheBytes() const { return std::numeric_limits<int64_t>::max(); }
  // How many views may be open at a time, each with all its pixels.
  virtual int MostOpenViews() const { return 1; }
  // Decodes a view. Throws UserError naming the file that can no longer be read.
  virtual std::unique_ptr<ViewPixels> OpenView(int view) const;
  // As Ray, with what OpenView has read at (x, y).
  virtual bool RayOf(int view, int x, int y, const PixelValue& value, TrainingRay* ray) const;
};

// A coloured SfM point in the normalised frame, to start the foam from.
struct SeedPoint {
  Eigen::Vector3f position;
  Eigen::Vector3f color;  // display values, 0..1
};

}  // namespace semfoam
