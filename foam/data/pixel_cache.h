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

// What a training will draw from, as far as that can be known ahead.
struct DrawingPlan {
  uint64_t seed = 0;
  int num_tiles = 0;               // of an iteration
  std::vector<PixelRange> ranges;  // that an iteration may draw from
  std::vector<ViewPixel> kept;     // pixels that are looked at again and again, in any order
  int64_t first_iteration = 0;     // > 0 for a run that is taken up again
  bool may_grow = false;           // the number of iterations is not known yet
  // Which of the ranges the iteration may draw from; ascending, at least one.
  std::function<std::vector<int>(int64_t iteration)> ranges_at;
};

// The pixels of photos that do not fit into memory. What an iteration draws is known ahead, and a
// run draws far fewer pixels than large photos have: so each photo is decoded, the pixels that a
// *chapter* of many iterations will draw are kept, and the photo goes. A run whose pixels all fit
// is one chapter; else the next chapter is read by a thread of its own while the present one is
// trained on, each in half of the memory. Which pixels are drawn depends on none of this: a run has
// the same bytes whatever the memory.
class PixelCache {
 public:
  // Called with how many of how many views have been read, while nothing else goes on; from any
  // thread, one at a time.
  using Report = std::function<void(int done, int total)>;

  // Bytes that a run of so many iterations takes, all in one chapter, and the least that any can
  // do with.
  static int64_t BytesOfRun(const DrawingPlan& plan, int64_t num_iterations);
  static int64_t LeastBytes(const DrawingPlan& plan);

  // `views` must outlive this, and are not HoldsPixels(). Reads nothing yet. Throws UserError that
  // says how much memory would be right where views.CacheBytes() is less than LeastBytes.
  PixelCache(const TrainingViews& views, DrawingPlan plan);
  ~PixelCache();
  PixelCache(const PixelCache&) = delete;
  PixelCache& operator=(const PixelCache&) = delete;

  // The kTileRays pixels of each tile that DrawTiles has for this iteration and range, in order;
  // valid until the next call. Iterations must not descend. `num_iterations`: of the run, as known
  // by now. Reads the chapter, or waits for it, where it is not there. Throws what
  // TrainingViews::OpenView throws, also for a chapter that is read ahead.
  const PixelValue* Drawn(int64_t iteration, int range, int64_t num_iterations);

  // Of DrawingPlan::kept. To be called after Drawn.
  const PixelValue& Kept(size_t index) const { return kept_values_[index]; }

  void SetReport(Report report) { report_ = std::move(report); }
  int num_chapters() const { return num_chapters_; }

 private:
  // What one iteration draws from one range.
  struct Batch {
    int64_t iteration;
    int range;
  };
  struct Chapter {
    int64_t begin = 0, end = 0;          // iterations
    std::vector<Batch> batches;          // ascending
    std::vector<int64_t> tiles;          // [batches][num_tiles]; gone when all is read
    std::vector<PixelValue> values;      // [batches][num_tiles][kTileRays]
    std::vector<int> views;              // to read
    std::atomic<bool> is_drawn = false;  // the tiles
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
  void Finish(Chapter* chapter);  // reads what is left of it, with all threads
  static void Abandon(Chapter* chapter);

  const TrainingViews& views_;
  const DrawingPlan plan_;
  const int64_t batch_bytes_;
  Report report_;
  std::vector<uint32_t> kept_order_;  // kept pixels by view
  std::vector<PixelValue> kept_values_;
  bool kept_are_read_ = false;
  std::unique_ptr<Chapter> now_, next_;
  int num_chapters_ = 0;
};

}  // namespace semfoam
