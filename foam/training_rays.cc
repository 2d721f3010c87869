// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/training_rays.h"

#include "foam/parallel.h"
#include "foam/random.h"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace semfoam {
namespace {

constexpr uint64_t kTilePurpose = 0x4a1, kQuantilePurpose = 0x4a2;

// A tile is kTileSide x kTileSide pixels, kTileStep apart: near enough to share cells, far enough
// not to say the same thing.
constexpr int kTileSide = 2;
constexpr int kTileRays = kTileSide * kTileSide;
constexpr int kTileStep = 2;

}  // namespace

PixelRange::PixelRange(const TrainingViews& views, const std::vector<int>& which) : views_(which) {
  for (const int view : views_) {
    widths_.push_back(views.Width(view));
    ends_.push_back((ends_.empty() ? 0 : ends_.back()) +
                    int64_t{views.Width(view)} * views.Height(view));
  }
}

ViewPixel PixelRange::At(int64_t index) const {
  const size_t k = std::upper_bound(ends_.begin(), ends_.end(), index) - ends_.begin();
  const int64_t local = index - (k == 0 ? 0 : ends_[k - 1]);
  return {views_[k], static_cast<int>(local % widths_[k]), static_cast<int>(local / widths_[k])};
}

std::vector<int> ViewsToTrainOn(const TrainingViews& views) {
  std::vector<int> result;
  for (int view = 0; view < views.NumViews(); ++view) {
    if (!views.IsHeldOut(view)) result.push_back(view);
  }
  return result;
}

std::optional<BatchRay> PixelAsRay(const TrainingViews& views,
                                   const ViewPixel& pixel,
                                   uint32_t start_cell) {
  TrainingRay ray;
  if (!views.Ray(pixel.view, pixel.x, pixel.y, &ray) || !ray.color.allFinite()) return {};
  BatchRay out;
  out.origin = views.Origin(pixel.view).cast<float>();
  out.direction = ray.direction;
  out.start_cell = start_cell;
  std::copy_n(ray.color.data(), 3, out.target.color);
  out.target.class_index = ray.class_index;
  return out;
}

int64_t DrawRays(const TrainingViews& views,
                 const PixelRange& pixels,
                 const std::vector<uint32_t>& start_cells,
                 int rays_per_iteration,
                 uint64_t seed,
                 int64_t iteration,
                 std::vector<BatchRay>* rays) {
  const int num_tiles = (rays_per_iteration + kTileRays - 1) / kTileRays;
  std::vector<int64_t> tiles(num_tiles);
  for (int i = 0; i < num_tiles; ++i) {
    CounterRandom random(seed, kTilePurpose, uint64_t(iteration) * num_tiles + i);
    tiles[i] = static_cast<int64_t>(random.Uniform() * pixels.size());
  }
  std::sort(tiles.begin(), tiles.end());
  const int batch = num_tiles * kTileRays;
  rays->resize(batch);

  std::vector<uint8_t> valid(batch);
  std::atomic<int64_t> nonfinite_pixels = 0;
  ParallelForBlocks(batch, 256, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      ViewPixel pixel = pixels.At(tiles[i / kTileRays]);
      // The drawn pixel is the tile's corner; tiles wrap around the photo's border, so that every
      // pixel is drawn equally often.
      const int in_tile = static_cast<int>(i % kTileRays);
      pixel.x = (pixel.x + kTileStep * (in_tile % kTileSide)) % views.Width(pixel.view);
      pixel.y = (pixel.y + kTileStep * (in_tile / kTileSide)) % views.Height(pixel.view);
      TrainingRay ray;
      valid[i] = views.Ray(pixel.view, pixel.x, pixel.y, &ray);
      if (!valid[i]) continue;
      if (!ray.color.allFinite()) {
        valid[i] = false;
        ++nonfinite_pixels;
        continue;
      }
      BatchRay& out = (*rays)[i];
      out.origin = views.Origin(pixel.view).cast<float>();
      out.direction = ray.direction;
      out.start_cell = start_cells[pixel.view];
      CounterRandom random(seed, kQuantilePurpose, uint64_t(iteration) * batch + i);
      const double tau0 = -std::log(1 - random.Uniform()), tau1 = -std::log(1 - random.Uniform());
      out.quantile_tau[0] = static_cast<float>(std::min(tau0, tau1));
      out.quantile_tau[1] = static_cast<float>(std::max(tau0, tau1));
      for (int c = 0; c < 3; ++c) out.target.color[c] = ray.color[c];
      out.target.class_index = ray.class_index;
    }
  });
  size_t kept = 0;
  for (int i = 0; i < batch; ++i) {
    if (valid[i]) (*rays)[kept++] = (*rays)[i];
  }
  rays->resize(kept);
  return nonfinite_pixels;
}

}  // namespace semfoam
