// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

inline constexpr int32_t kUnlabelled = -1;

// One pixel of a photo as a ray with its targets.
struct TrainingRay {
  Eigen::Vector3f direction;  // unit length
  Eigen::Vector3f color;      // display values (sRGB / 255), 0..1
  int32_t class_index =
      kUnlabelled;  // class of the pixel, or kUnlabelled: trains colour, not identity
};

// The photos as the trainer sees them: rays in the normalised frame, made on the fly from (view,
// pixel); colour and class of a pixel come from the same call, so they cannot drift apart.
// Thread-safe: all calls are const.
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
  virtual bool Ray(int view, int x, int y, TrainingRay* ray) const = 0;
};

// A coloured SfM point in the normalised frame, to start the foam from.
struct SeedPoint {
  Eigen::Vector3f position;
  Eigen::Vector3f color;  // display values, 0..1
};

}  // namespace semfoam
