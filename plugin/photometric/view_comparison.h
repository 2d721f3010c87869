// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"
#include "plugin/dataset/training_scene.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A training photo beside its render, on a grid of pixels.
struct ComparedView {
  int view = 0;
  // Distance of the grid's pixels. The pixel of column c and row r is (c, r) * stride + stride / 2.
  int stride = 1;
  int columns = 0;
  int rows = 0;
  // [rows][columns] The photo's display values, 0..1, and what the foam shows there; a pixel
  // without a ray has opacity 0.
  std::vector<Eigen::Vector3f> photo;
  std::vector<RenderedRay> rendered;

  int X(size_t i) const { return static_cast<int>(i) % columns * stride + stride / 2; }
  int Y(size_t i) const { return static_cast<int>(i) / columns * stride + stride / 2; }
};

// Returns the least number of rays that CompareViews renders: 300 for each training photo.
int64_t FewestComparedRays(const TrainingScene& scene);

// Compares every training photo of the scene with its render, on about `num_rays` pixels in all,
// but 300 to 4800 of each. Decodes photos again that are not in memory. Held-out photos are not
// looked at.
std::vector<ComparedView> CompareViews(const TrainingScene& scene,
                                       int64_t num_rays,
                                       const TrainingHooks::RenderPixels& render);

}  // namespace semfoam
