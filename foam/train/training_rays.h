// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/pixel_range.h"
#include "foam/data/training_views.h"
#include "foam/render/ray_batch.h"
#include "foam/train/drawn_squares.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace semfoam {

// Returns the views that are held out, or those that are not, ascending.
std::vector<int> SelectViews(const TrainingViews& views, bool held_out);

// Returns the pixel's ray and targets; nothing where it has no ray or its colour is not finite.
// `value` is the stored pixel, for views that do not hold their pixels; otherwise null.
std::optional<BatchRay> PixelAsRay(const TrainingViews& views,
                                   const ViewPixel& pixel,
                                   const PixelValue* value,
                                   uint32_t start_cell);

// Returns the number of tiles (DrawTiles) of an iteration of about `rays_per_iteration` rays.
inline int NumTiles(int rays_per_iteration) {
  return (rays_per_iteration + kTileRays - 1) / kTileRays;
}

// Draws the rays of an iteration, about `rays_per_iteration`: tiles of neighbouring pixels, which
// walk through the same cells and find them in the cache, in the order of the photos. Leaves out
// pixels without a ray (a lens that cannot be inverted there) and pixels whose colour is not
// finite; returns the number of the latter. Random numbers are keyed by (seed, iteration).
// `start_cells` [NumViews]. `values` holds the pixels of each tile for views that do not hold them
// (PixelCache::Drawn); otherwise null. Leaves out tiles whose corner is not in `squares`.
int64_t DrawRays(const TrainingViews& views,
                 const PixelRange& pixels,
                 const PixelValue* values,
                 const std::vector<uint32_t>& start_cells,
                 int rays_per_iteration,
                 uint64_t seed,
                 int64_t iteration,
                 const DrawnSquares& squares,
                 std::vector<BatchRay>* rays);

}  // namespace semfoam
