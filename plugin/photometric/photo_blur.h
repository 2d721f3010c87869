// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/training_scene.h"

#include <optional>
#include <string>
#include <vector>

namespace semfoam {

// Finds photos that are blurred: the camera shook, or was not in focus. A foam that is trained on
// them as on the others is blurred too.
//
// Tracks show the same places in several photos, and PhotoSurvey::contrasts how much contrast each
// of these has there at the same distance in space. The contrast of a photo is the median, over its
// places, of the ratio of its contrast to the median of the other training photos'. Compared at one
// distance in pixels instead, photos from near would look blurred.

// A photo is blurred if its contrast, a mean square, is less than this.
inline constexpr double kBlurredContrast = 0.5;
// Least number of training photos that tell of a place, and of places that tell of a photo.
inline constexpr int kFewestPhotosOfPlace = 4;
inline constexpr int kFewestPlacesOfPhoto = 10;
// Where a larger share of the training photos would be blurred, none is: a second camera is softer,
// or the tracks are of few photos that are not like the rest.
inline constexpr double kMostBlurred = 0.25;
// In so many passes over the photos each pixel of a blurred one is drawn once
// (TrainingViews::PassesPerDraw): they may show what no other does.
inline constexpr int kPassesOfBlurred = 4;

struct PhotoBlur {
  // [views] The contrast of each training photo; nothing for held-out photos, and where too few
  // tracks tell.
  std::vector<std::optional<double>> contrasts;
  // The blurred ones, ascending.
  std::vector<int> blurred;
  // Number of photos with so little contrast that are not blurred, for there are too many of them.
  int num_soft = 0;

  // Returns TrainingViews::PassesPerDraw of all views; empty where no photo is blurred.
  std::vector<int> PassesPerDraw() const;
  // Returns "3 of 56 photos have ..." with their names, the most blurred first.
  std::string Report(const TrainingScene& scene) const;
};

// Compares the contrasts of the scene's photos as they are. Held-out photos take no part.
PhotoBlur FindBlurredPhotos(const TrainingScene& scene);

}  // namespace semfoam
