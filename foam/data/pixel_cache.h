// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/pixel_range.h"
#include "foam/data/training_views.h"

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace semfoam {

// The pixels that a training will draw from, as far as they are known in advance.
struct DrawingPlan {
  // Seed of all random numbers.
  uint64_t seed = 0;
  // Number of tiles of an iteration.
  int num_tiles = 0;
  // Ranges that iterations may draw from.
  std::vector<PixelRange> ranges;
  // Pixels that are read throughout the run, in any order.
  std::vector<ViewPixel> kept;
  // First iteration of this run; > 0 if it resumes from a checkpoint.
  int64_t first_iteration = 0;
  // Whether the number of iterations may still grow.
  bool may_grow = false;
  // Which of the ranges the iteration may draw from; ascending, at least one.
  std::function<std::vector<int>(int64_t iteration)> ranges_at;
  // Returns whether drawn pixels of this view are used; those of others are not read. Empty: all
  // are.
  std::function<bool(int view)> is_used;
};

// Holds the drawn pixels of photos that do not fit into memory. The pixels of each iteration are
// known in advance, and a run draws far fewer pixels than large photos have: so each photo is
// decoded, the pixels that the iterations of a *chapter* will draw are kept, and the photo is
// released. A run whose pixels all fit is one chapter; otherwise a separate thread reads the next
// chapter while training uses the present one, each in half of the memory. The choice of pixels
// does not depend on the chapters: a run produces the same bytes with any amount of memory.
class PixelCache {
 public:
  // Receives the number of views read and of all views to read, while training waits for them;
  // called from any thread, one call at a time.
  using Report = std::function<void(int done, int total)>;

  // Return the bytes that a run of `num_iterations` takes in one chapter, and the minimum that any
  // run needs.
  static int64_t BytesOfRun(const DrawingPlan& plan, int64_t num_iterations);
  static int64_t LeastBytes(const DrawingPlan& plan);

  // `views` must outlive this object and must not be HoldsPixels(). Reads nothing yet. Throws
  // UserError with the memory that is needed where views.CacheBytes() is less than LeastBytes.
  PixelCache(const TrainingViews& views, DrawingPlan plan);
  ~PixelCache();
  PixelCache(const PixelCache&) = delete;
  PixelCache& operator=(const PixelCache&) = delete;

  // Returns the kTileRays pixels of each tile of DrawTiles for this iteration and range, in order;
  // valid until the next call. Iterations must not descend. `num_iterations` is the number of the
  // run as known by now. Reads the iteration's chapter, or waits for it, if it is not in memory.
  // Throws what TrainingViews::OpenView throws, also for a chapter that is read in advance.
  const PixelValue* Drawn(int64_t iteration, int range, int64_t num_iterations);

  // Returns the pixel DrawingPlan::kept[index]. Must be called after Drawn.
  const PixelValue& Kept(size_t index) const { return kept_values_[index]; }

  void SetReport(Report report) { report_ = std::move(report); }
  int num_chapters() const { return num_chapters_; }

 private:
  // The tiles that one iteration draws from one range.
  struct Batch {
    int64_t iteration;
    int range;
  };
  struct Chapter {
    // Iterations [begin, end).
    int64_t begin = 0, end = 0;
    // Batches in ascending order.
    std::vector<Batch> batches;
    // [batches][num_tiles] Corners; freed when all pixels are read.
    std::vector<int64_t> tiles;
    // [batches][num_tiles][kTileRays] Pixels.
    std::vector<PixelValue> values;
    // Views to read.
    std::vector<int> views;
    // Whether `tiles` is complete.
    std::atomic<bool> is_drawn = false;
    std::atomic<size_t> next_view = 0;
    std::atomic<int> num_read = 0;
    std::atomic<bool> stop = false;
    std::mutex mutex;
    std::exception_ptr error;
    std::thread reader;
  };

  std::unique_ptr<Chapter> Plan(int64_t begin, int64_t num_iterations) const;
  void Draw(Chapter* chapter, int threads);
  static void Fail(Chapter* chapter);
  void ReadViews(Chapter* chapter, const Report& report);
  void ReadView(int view, Chapter* chapter);
  // Reads the remaining views of the chapter, with all threads.
  void Finish(Chapter* chapter);
  static void Abandon(Chapter* chapter);

  const TrainingViews& views_;
  const DrawingPlan plan_;
  const int64_t batch_bytes_;
  Report report_;
  // Indices of the kept pixels, ordered by view.
  std::vector<uint32_t> kept_order_;
  std::vector<PixelValue> kept_values_;
  bool kept_are_read_ = false;
  std::unique_ptr<Chapter> now_, next_;
  int num_chapters_ = 0;
};

}  // namespace semfoam
