// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/ray_batch.h"
#include "foam/training_views.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace semfoam {

struct ViewPixel {
  int view, x, y;
};

// The pixels of some views as one range, so that every pixel is drawn equally often.
class PixelRange {
 public:
  PixelRange() = default;
  PixelRange(const TrainingViews& views, const std::vector<int>& which);

  int64_t size() const { return ends_.empty() ? 0 : ends_.back(); }
  ViewPixel At(int64_t index) const;

 private:
  std::vector<int> views_;
  std::vector<int> widths_;
  std::vector<int64_t> ends_;
};

// The views that are not held out, ascending.
std::vector<int> ViewsToTrainOn(const TrainingViews& views);

// The pixel's ray and colour; nothing where it has no ray or its colour is not finite.
std::optional<BatchRay> PixelAsRay(const TrainingViews& views,
                                   const ViewPixel& pixel,
                                   uint32_t start_cell);

// Draws the rays of an iteration, about so many: tiles of neighbouring pixels, which walk through
// the same cells and find them in the cache, in the order of the photos. Pixels without a ray (a
// lens that cannot be inverted there) drop out, and so do those whose colour is not finite, which
// are counted and returned. Random numbers are keyed by (seed, iteration). `start_cells` per view.
int64_t DrawRays(const TrainingViews& views,
                 const PixelRange& pixels,
                 const std::vector<uint32_t>& start_cells,
                 int rays_per_iteration,
                 uint64_t seed,
                 int64_t iteration,
                 std::vector<BatchRay>* rays);

}  // namespace semfoam
