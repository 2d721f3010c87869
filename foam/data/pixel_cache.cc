// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/data/pixel_cache.h"

#include "foam/util/error.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

int64_t BatchBytes(const DrawingPlan& plan) {
  return plan.num_tiles * (int64_t{sizeof(int64_t)} + kTileRays * int64_t{sizeof(PixelValue)});
}

int64_t KeptBytes(const DrawingPlan& plan) {
  return static_cast<int64_t>(plan.kept.size() *
                              (sizeof(ViewPixel) + sizeof(uint32_t) + sizeof(PixelValue)));
}

int64_t NumBatches(const DrawingPlan& plan, int64_t begin, int64_t end) {
  int64_t batches = 0;
  for (int64_t i = begin; i < end; ++i) batches += static_cast<int64_t>(plan.ranges_at(i).size());
  return batches;
}

}  // namespace

int64_t PixelCache::BytesOfRun(const DrawingPlan& plan, int64_t num_iterations) {
  return KeptBytes(plan) +
         NumBatches(plan, plan.first_iteration, num_iterations) * BatchBytes(plan);
}

int64_t PixelCache::LeastBytes(const DrawingPlan& plan) {
  // Two chapters of one iteration.
  return KeptBytes(plan) + 2 * static_cast<int64_t>(plan.ranges.size()) * BatchBytes(plan);
}

PixelCache::PixelCache(const TrainingViews& views, DrawingPlan plan)
    : views_(views), plan_(std::move(plan)), batch_bytes_(BatchBytes(plan_)) {
  if (views_.CacheBytes() < LeastBytes(plan_)) {
    char least[32];
    std::snprintf(least,
                  sizeof(least),
                  "%.3g",
                  std::ceil(static_cast<double>(LeastBytes(plan_)) / 1e6) / 1e3);
    throw FieldError("image_cache_gb",
                     " is too little for the pixels of two iterations; ",
                     least,
                     " or more would be right.");
  }
  kept_order_.resize(plan_.kept.size());
  std::iota(kept_order_.begin(), kept_order_.end(), 0);
  std::stable_sort(kept_order_.begin(), kept_order_.end(), [&](uint32_t a, uint32_t b) {
    return plan_.kept[a].view < plan_.kept[b].view;
  });
  kept_values_.resize(plan_.kept.size());
}

PixelCache::~PixelCache() {
  if (next_) Abandon(next_.get());
}

void PixelCache::Abandon(Chapter* chapter) {
  chapter->stop = true;
  if (chapter->reader.joinable()) chapter->reader.join();
}

std::unique_ptr<PixelCache::Chapter> PixelCache::Plan(int64_t begin, int64_t num_iterations) const {
  const int64_t room = views_.CacheBytes() - KeptBytes(plan_);
  const bool all_fit = !plan_.may_grow && begin == plan_.first_iteration &&
                       BytesOfRun(plan_, num_iterations) <= views_.CacheBytes();
  const int64_t most_batches = (all_fit ? room : room / 2) / batch_bytes_;
  auto chapter = std::make_unique<Chapter>();
  chapter->begin = chapter->end = begin;
  for (; chapter->end < num_iterations; ++chapter->end) {
    const std::vector<int> ranges = plan_.ranges_at(chapter->end);
    if (static_cast<int64_t>(chapter->batches.size() + ranges.size()) > most_batches) break;
    for (const int range : ranges) chapter->batches.push_back({chapter->end, range});
  }
  std::vector<char> is_read(views_.NumViews(), 0);
  for (const PixelRange& range : plan_.ranges) {
    for (const int view : range.views()) is_read[view] = !plan_.is_used || plan_.is_used(view);
  }
  if (!kept_are_read_) {
    for (const ViewPixel& pixel : plan_.kept) is_read[pixel.view] = 1;
  }
  for (int view = 0; view < views_.NumViews(); ++view) {
    if (is_read[view]) chapter->views.push_back(view);
  }
  return chapter;
}

void PixelCache::ReadView(int view, Chapter* chapter) {
  const std::unique_ptr<ViewPixels> pixels = views_.OpenView(view);
  const int width = views_.Width(view), height = views_.Height(view);
  std::vector<int64_t> place(plan_.ranges.size(), -1);  // of the view in each range
  for (size_t r = 0; r < plan_.ranges.size(); ++r) {
    const std::vector<int>& in_range = plan_.ranges[r].views();
    const auto found = std::lower_bound(in_range.begin(), in_range.end(), view);
    if (found != in_range.end() && *found == view) place[r] = found - in_range.begin();
  }
  for (size_t b = 0; b < chapter->batches.size(); ++b) {
    const int r = chapter->batches[b].range;
    if (place[r] < 0) continue;
    const PixelRange& range = plan_.ranges[r];
    const int64_t* tiles = chapter->tiles.data() + b * plan_.num_tiles;
    const int64_t* end = tiles + plan_.num_tiles;
    const int64_t last = range.End(place[r]);
    for (const int64_t* tile = std::lower_bound(tiles, end, range.Begin(place[r]));
         tile != end && *tile < last;
         ++tile) {
      PixelValue* values =
          chapter->values.data() + (b * plan_.num_tiles + (tile - tiles)) * kTileRays;
      const int64_t local = *tile - range.Begin(place[r]);
      const ViewPixel corner = {
          view, static_cast<int>(local % width), static_cast<int>(local / width)};
      for (int k = 0; k < kTileRays; ++k) {
        const ViewPixel pixel = TilePixel(corner, k, width, height);
        values[k] = pixels->At(pixel.x, pixel.y);
      }
    }
  }
  if (kept_are_read_) return;
  const auto in_order = [&](uint32_t k, int v) { return plan_.kept[k].view < v; };
  for (auto k = std::lower_bound(kept_order_.begin(), kept_order_.end(), view, in_order);
       k != kept_order_.end() && plan_.kept[*k].view == view;
       ++k) {
    kept_values_[*k] = pixels->At(plan_.kept[*k].x, plan_.kept[*k].y);
  }
}

void PixelCache::Draw(Chapter* chapter, int threads) {
  try {
    const size_t tiles_of_batch = plan_.num_tiles;
    chapter->tiles.resize(chapter->batches.size() * tiles_of_batch);
    chapter->values.resize(chapter->tiles.size() * kTileRays);
    const auto count = static_cast<int64_t>(chapter->batches.size());
    const auto draw = [&](int64_t begin, int64_t end) {
      for (int64_t b = begin; b < end; ++b) {
        const Batch& batch = chapter->batches[b];
        const std::vector<int64_t> tiles =
            DrawTiles(plan_.seed, batch.iteration, plan_.num_tiles, plan_.ranges[batch.range]);
        std::copy(tiles.begin(), tiles.end(), chapter->tiles.begin() + b * tiles_of_batch);
      }
    };
    if (threads > 1) {
      ParallelForBlocks(count, 64, draw);
    } else {
      draw(0, count);
    }
  } catch (...) {
    Fail(chapter);
  }
  chapter->is_drawn = true;
  chapter->is_drawn.notify_all();
}

// To be called where an exception is caught.
void PixelCache::Fail(Chapter* chapter) {
  const std::lock_guard lock(chapter->mutex);
  if (!chapter->error) chapter->error = std::current_exception();
  chapter->stop = true;
}

// Any number of threads may call this for one chapter.
void PixelCache::ReadViews(Chapter* chapter, const Report& report) {
  while (!chapter->stop) {
    const size_t k = chapter->next_view++;
    if (k >= chapter->views.size()) return;
    try {
      ReadView(chapter->views[k], chapter);
    } catch (...) {
      return Fail(chapter);
    }
    const std::lock_guard lock(chapter->mutex);
    ++chapter->num_read;
    if (report) report(chapter->num_read, static_cast<int>(chapter->views.size()));
  }
}

void PixelCache::Finish(Chapter* chapter) {
  chapter->is_drawn.wait(false);
  const int threads = std::min(NumThreads(), views_.MostOpenViews());
  ParallelForBlocks(threads, 1, [&](int64_t, int64_t) { ReadViews(chapter, report_); });
  if (chapter->reader.joinable()) chapter->reader.join();
  if (chapter->error) std::rethrow_exception(chapter->error);
  chapter->tiles = {};
  kept_are_read_ = true;
  ++num_chapters_;
}

const PixelValue* PixelCache::Drawn(int64_t iteration, int range, int64_t num_iterations) {
  CHECK_GE(iteration, plan_.first_iteration);
  if (!now_ || iteration >= now_->end) {
    now_.reset();
    if (next_) {
      now_ = std::move(next_);
    } else {
      now_ = Plan(iteration, num_iterations);
      Draw(now_.get(), NumThreads());
    }
    Finish(now_.get());
  }
  if (!next_ && now_->end < num_iterations) {
    next_ = Plan(now_->end, num_iterations);
    next_->reader = std::thread([this, chapter = next_.get()] {
      Draw(chapter, /*threads=*/1);
      ReadViews(chapter, nullptr);
    });
  }
  // A failure is told when it happens, not when the chapter's turn has come.
  if (next_ && next_->stop) Finish(next_.get());
  const auto batch = std::lower_bound(now_->batches.begin(),
                                      now_->batches.end(),
                                      std::pair(iteration, range),
                                      [](const Batch& a, const std::pair<int64_t, int>& b) {
                                        return std::pair(a.iteration, a.range) < b;
                                      });
  CHECK(batch != now_->batches.end() && batch->iteration == iteration && batch->range == range)
      << "iteration " << iteration << " was not expected to draw from range " << range;
  return now_->values.data() + (batch - now_->batches.begin()) * plan_.num_tiles * kTileRays;
}

}  // namespace semfoam
