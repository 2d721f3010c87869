// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/pixel_cache.h"
#include "foam/data/pixel_range.h"
#include "foam/data/training_views.h"
#include "foam/render/ray_batch.h"
#include "foam/train/drawn_squares.h"
#include "foam/train/training_options.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

// Chooses the pixels that a training uses: those that it learns from, the probes that decide the SH
// degree (sh_degree_selector.h), and those of held-out views that measure its progress.

namespace semfoam {

// Whether an iteration draws from the probes' photos too, as far as that is known in advance.
enum class ProbeUse { kSetApart, kTrainedOn, kUnknown };

// Divides the views of a training into photos to learn from and probes, draws the rays of its
// iterations, and keeps the pixels of views that do not fit into memory (foam/data/pixel_cache.h).
// Random numbers are keyed by (TrainingOptions::random_seed, iteration).
class TrainingPixels {
 public:
  // Sets probes apart if the SH degree is to be chosen and there are enough photos. Both arguments
  // must outlive this object.
  TrainingPixels(const TrainingViews& views, const TrainingOptions& options);

  // Returns the views that are not held out, ascending; the probes are among them.
  const std::vector<int>& training_views() const { return training_views_; }

  // Returns whether there is no pixel to learn from.
  bool IsEmpty() const { return drawn_.size() == 0; }
  bool HasProbes() const { return probes_.size() > 0; }

  // Draws from the probes' photos too from the next iteration on; there are no probes after this.
  void ReleaseProbes();

  // Prepares to keep the pixels of views that do not hold theirs; does nothing for other views.
  // Must be called once, before any pixel is requested. `probe_use` returns for every iteration
  // from `first_iteration` on whether it draws from the probes' photos, and must stay valid as long
  // as this object. Throws UserError as PixelCache does.
  void OpenCache(int64_t first_iteration, std::function<ProbeUse(int64_t iteration)> probe_use);

  // Reads the pixels to keep for `first_iteration`, calling `report`, which may be empty, for every
  // view. `num_iterations` is the number of the run as known by now. Throws as PixelCache::Drawn
  // does.
  void Read(int64_t first_iteration, int64_t num_iterations, PixelCache::Report report);

  // Draws the rays of an iteration (DrawRays), which must not be lower than the one before.
  // `start_cells` [NumViews]. Returns the number of pixels left out because their colour is not
  // finite. Throws as PixelCache::Drawn does.
  int64_t Draw(int64_t iteration,
               int64_t num_iterations,
               const std::vector<uint32_t>& start_cells,
               std::vector<BatchRay>* rays);

  // The squares that iterations draw from: all, but for a run that trains one block.
  DrawnSquares& squares() { return squares_; }

  // Returns the rays of the probes, always of the same pixels; empty without probes.
  std::vector<BatchRay> ProbeRays(const std::vector<uint32_t>& start_cells) const;

  // Returns a grid of pixels over the held-out views (EvaluationStride), view by view.
  std::vector<ViewPixel> HeldOutPixels() const;

  // Returns the stored value of the k-th of HeldOutPixels(), for views that do not hold their
  // pixels; null for others.
  const PixelValue* HeldOutValue(size_t k) const;

 private:
  // Indices into DrawingPlan::ranges.
  enum Range { kAllButProbes, kAllViews };

  Range DrawnRange() const { return HasProbes() ? kAllButProbes : kAllViews; }
  std::vector<ViewPixel> ProbePixels() const;

  const TrainingViews& views_;
  const TrainingOptions& options_;
  const std::vector<int> training_views_;
  // The pixels that iterations draw from.
  PixelRange drawn_;
  // The pixels of the probes' photos; empty when the SH degree is final.
  PixelRange probes_;
  DrawnSquares squares_;
  // Null for views that hold their pixels.
  std::unique_ptr<PixelCache> cache_;
  // Number of probes among the cache's kept pixels; they come first.
  size_t num_probes_kept_ = 0;
};

}  // namespace semfoam
