// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/training_rays.h"

#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

namespace semfoam {
namespace {

constexpr uint64_t kQuantilePurpose = 0x4a2;
constexpr int kBlockTiles = 64;

enum class PixelKind { kTrains, kHasNoRay, kIsNotFinite };

// Fills everything of `out` but quantile_tau, where the pixel can be trained on.
PixelKind MakeBatchRay(const TrainingViews& views,
                       const ViewPixel& pixel,
                       const PixelValue* value,
                       uint32_t start_cell,
                       BatchRay* out) {
  TrainingRay ray;
  const bool has_ray = value == nullptr ? views.Ray(pixel.view, pixel.x, pixel.y, &ray)
                                        : views.RayOf(pixel.view, pixel.x, pixel.y, *value, &ray);
  if (!has_ray) return PixelKind::kHasNoRay;
  if (!ray.color.allFinite()) return PixelKind::kIsNotFinite;
  out->origin = views.Origin(pixel.view).cast<float>();
  out->direction = ray.direction;
  out->start_cell = start_cell;
  std::copy_n(ray.color.data(), 3, out->target.color);
  out->target.at_least = ray.at_least;
  out->target.class_index = Value(ray.class_index);
  out->target.distance = ray.distance;
  return PixelKind::kTrains;
}

}  // namespace

std::vector<int> SelectViews(const TrainingViews& views, bool held_out) {
  std::vector<int> result;
  for (int view = 0; view < views.NumViews(); ++view) {
    if (views.IsHeldOut(view) == held_out) result.push_back(view);
  }
  return result;
}

std::optional<BatchRay> PixelAsRay(const TrainingViews& views,
                                   const ViewPixel& pixel,
                                   const PixelValue* value,
                                   uint32_t start_cell) {
  BatchRay out;
  if (MakeBatchRay(views, pixel, value, start_cell, &out) != PixelKind::kTrains) return {};
  return out;
}

int64_t DrawRays(const TrainingViews& views,
                 const PixelRange& pixels,
                 const PixelValue* values,
                 const std::vector<uint32_t>& start_cells,
                 int rays_per_iteration,
                 uint64_t seed,
                 int64_t iteration,
                 const DrawnSquares& squares,
                 std::vector<BatchRay>* rays) {
  const int num_tiles = NumTiles(rays_per_iteration);
  const std::vector<int64_t> tiles = DrawTiles(seed, iteration, num_tiles, pixels);
  const int batch = num_tiles * kTileRays;
  rays->resize(batch);

  std::vector<uint8_t> valid(batch);
  std::atomic<int64_t> nonfinite_pixels = 0;
  ParallelForBlocks(num_tiles, kBlockTiles, [&](int64_t begin, int64_t end) {
    // All at once, so that many pixels are on their way from memory at a time.
    std::array<ViewPixel, kBlockTiles * kTileRays> drawn;
    for (int64_t tile = begin; tile < end; ++tile) {
      const ViewPixel corner = pixels.At(tiles[tile]);
      const int width = views.Width(corner.view), height = views.Height(corner.view);
      for (int k = 0; k < kTileRays; ++k) {
        const int64_t i = tile * kTileRays + k;
        ViewPixel& pixel = drawn[i - begin * kTileRays];
        pixel = TilePixel(corner, k, width, height);
        valid[i] = squares.Contains(corner);
        if (valid[i] && values == nullptr) views.Prefetch(pixel.view, pixel.x, pixel.y);
      }
    }
    for (int64_t i = begin * kTileRays; i < end * kTileRays; ++i) {
      if (!valid[i]) continue;
      const ViewPixel& pixel = drawn[i - begin * kTileRays];
      BatchRay& out = (*rays)[i];
      const PixelKind kind = MakeBatchRay(
          views, pixel, values == nullptr ? nullptr : &values[i], start_cells[pixel.view], &out);
      valid[i] = kind == PixelKind::kTrains;
      if (kind == PixelKind::kIsNotFinite) ++nonfinite_pixels;
      if (!valid[i]) continue;
      CounterRandom random(seed, kQuantilePurpose, uint64_t(iteration) * batch + i);
      const double tau0 = -std::log(1 - random.Uniform()), tau1 = -std::log(1 - random.Uniform());
      out.quantile_tau[0] = static_cast<float>(std::min(tau0, tau1));
      out.quantile_tau[1] = static_cast<float>(std::max(tau0, tau1));
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
