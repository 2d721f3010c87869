// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/pixel_range.h"
#include "foam/data/training_views.h"
#include "foam/render/ray_batch.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace semfoam {

// Returns the views that are held out, or those that are not, ascending.
std::vector<int> SelectViews(const TrainingViews& views, bool held_out);

// Returns the pixel's ray and colour; nothing where it has no ray or its colour is not finite.
// `value`: what the photo stores of it, for views that do not hold their pixels; else null.
std::optional<BatchRay> PixelAsRay(const TrainingViews& views,
                                   const ViewPixel& pixel,
                                   const PixelValue* value,
                                   uint32_t start_cell);

// Returns how many tiles (DrawTiles) make up an iteration of about so many rays.
inline int NumTiles(int rays_per_iteration) {
  return (rays_per_iteration + kTileRays - 1) / kTileRays;
}

// Draws the rays of an iteration, about so many: tiles of neighbouring pixels, which walk through
// the same cells and find them in the cache, in the order of the photos. Pixels without a ray (a
// lens that cannot be inverted there) drop out, and so do those whose colour is not finite, which
// are counted and returned. Random numbers are keyed by (seed, iteration). `start_cells` per view.
// `values`: of each tile's pixels, for views that do not hold them (PixelCache::Drawn); else null.
int64_t DrawRays(const TrainingViews& views,
                 const PixelRange& pixels,
                 const PixelValue* values,
                 const std::vector<uint32_t>& start_cells,
                 int rays_per_iteration,
                 uint64_t seed,
                 int64_t iteration,
                 std::vector<BatchRay>* rays);

}  // namespace semfoam
