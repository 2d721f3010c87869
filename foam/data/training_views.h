// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/block_contrast.h"
#include "foam/data/solid_ground.h"
#include "foam/util/ids.h"

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// One pixel of a photo as a ray with its targets.
struct TrainingRay {
  // Unit length, normalised frame.
  Eigen::Vector3f direction;
  // Display values (sRGB / 255), 0..1.
  Eigen::Vector3f color;
  // Bit c: channel c may be brighter than that, for the photo is saturated.
  uint8_t at_least = 0;
  // Class of the pixel; kUnlabelled: the ray trains colour, not identity.
  ClassIndex class_index = kUnlabelled;
  // Distance along the ray to the surface that it shows, as far as other photos tell; 0: not known.
  float distance = 0;
};

// Colour and class of one pixel as stored for photos that do not all fit into memory. Without
// padding, because there may be hundreds of millions of them.
struct PixelValue {
  // RGB.
  uint8_t color[3];
  // The class, low byte first; 0xffff = kUnlabelled.
  uint8_t class_bytes[2];

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

// Holds the decoded pixels of one view while it exists.
class ViewPixels {
 public:
  virtual ~ViewPixels() = default;
  virtual PixelValue At(int x, int y) const = 0;
};

// Interface of the trainer to the photos: makes rays in the normalised frame from (view, pixel).
// Colour and class of a pixel come from the same call, so they always belong together. Thread-safe:
// all calls are const.
//
// Views that do not fit into memory (HoldsPixels is false) are read one after the other: the
// trainer knows which pixels it will draw, and keeps only these (pixel_cache.h).
class TrainingViews {
 public:
  virtual ~TrainingViews() = default;

  virtual int NumViews() const = 0;
  virtual int Width(int view) const = 0;
  virtual int Height(int view) const = 0;
  virtual bool IsHeldOut(int view) const = 0;
  // Returns the camera centre in the normalised frame.
  virtual Eigen::Vector3d Origin(int view) const = 0;

  // Computes the ray through the centre of pixel (x, y), that is through (x + 0.5, y + 0.5), and
  // its targets. Returns false where the camera model has no ray for the pixel (its distortion
  // cannot be inverted there). CHECKs HoldsPixels().
  virtual bool Ray(int view, int x, int y, TrainingRay* ray) const = 0;

  // Starts to load what Ray reads of the pixel into the CPU's cache; pixels drawn at random are
  // hardly ever there.
  virtual void Prefetch(int /*view*/, int /*x*/, int /*y*/) const {}

  // Computes the direction of that ray alone; the pixels need not be in memory.
  virtual bool RayDirection(int view, int x, int y, Eigen::Vector3f* direction) const {
    TrainingRay ray;
    if (!Ray(view, x, y, &ray)) return false;
    *direction = ray.direction;
    return true;
  }

  // Returns the contrast of the view's photo, which must live as long as the views; null where it
  // is not known.
  virtual const BlockContrast* Contrast(int /*view*/) const { return nullptr; }

  // Returns in how many passes over the photos (PixelRange) each pixel of the view is drawn once:
  // 1, or more where the view is to count less.
  virtual int PassesPerDraw(int /*view*/) const { return 1; }

  // Returns what the things that the views show stand on; nothing where it is not known to be a
  // plane.
  virtual std::optional<SolidGround> Ground() const { return std::nullopt; }

  // Returns whether pixels of the view may have a class.
  virtual bool HasLabels(int /*view*/) const { return true; }

  // Returns whether all pixels are in memory. Classes that return false must implement the
  // functions below.
  virtual bool HoldsPixels() const { return true; }
  // Returns the maximum memory for kept pixels, in bytes.
  virtual int64_t CacheBytes() const { return std::numeric_limits<int64_t>::max(); }
  // Returns the maximum number of views that may be open at a time, each with all its pixels.
  virtual int MostOpenViews() const { return 1; }
  // Decodes a view. Throws UserError naming the file where it can no longer be read.
  virtual std::unique_ptr<ViewPixels> OpenView(int view) const;
  // Computes the ray as Ray does, with the `value` that ViewPixels::At returned for (x, y).
  virtual bool RayOf(int view, int x, int y, const PixelValue& value, TrainingRay* ray) const;
};

// A coloured point in the normalised frame, to start the foam from.
struct SeedPoint {
  Eigen::Vector3f position;
  // Display values, 0..1.
  Eigen::Vector3f color;
  // Whether it is of a dense point cloud; false: an SfM point. SfM points come first in a list.
  bool is_dense = false;
};

}  // namespace semfoam
