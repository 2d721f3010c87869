// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/render/ray_batch.h"

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace semfoam {

// Watches a training run, and ends it where nothing good can come of it any more: better one
// sentence than a foam that looks like a result. A run is lost
//
// - at once, when a loss term is not finite. Gradients that are not finite change no parameter, so
//   what overflows now overflows again;
// - when, in a window of 50 iterations, more than one ray in a hundred hit the walk's step limit,
//   or more than one update for every hundred rays was skipped. One stuck cell is none of that;
// - when the colour loss stays above 1.25 times that of photos in one flat colour (half the
//   variance of their pixels) for four windows in a row, and no longer falls by a fifth from each
//   to the next. Every foam that learns is below that within its first hundred iterations or
//   falls fast; even photos of pure noise, from which nothing can be learned, are seen as their
//   mean. The bound is never below 0.02, an error of 0.2, which tells nothing of photos that are
//   black or white throughout and have no variance;
// - likewise when the identity loss stays above 2. Guessing has 1;
// - when a run of five windows or more ends with either loss above its bound, falling or not; the
//   factor is 1.05 then.
//
// The criteria are free of the scene's scale and of batch size, loss weights and number of rays.
class TrainingGuard {
 public:
  // Looks at the iteration that was just done; tv_loss = 0 where none was computed. Throws
  // UserError, one sentence naming the iteration and the quantity, when the run is lost.
  void Watch(int64_t iteration,
             const std::vector<BatchRay>& rays,
             const BatchTotals& batch,
             double tv_loss,
             int64_t skipped_updates);

  // After the last iteration. Throws as Watch does.
  void Finish(int64_t iteration) const;

  // Iterations, in whole windows after the first, whose losses were above those bounds: more than
  // none in a run that ended well means that it recovered.
  int64_t unstable_iterations() const { return unstable_iterations_; }

  // 1 - colour loss / that of one flat colour, over the last whole window: what the foam shows of
  // the photos' contrast, at most 1. NaN before the first window and where photos have none.
  double explained_contrast() const { return explained_contrast_; }

  // What it has seen so far (checkpoint_state.h).
  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Number("iterations", &window_.iterations);
    archive->Number("rays", &window_.rays);
    archive->Number("step_limit_hits", &window_.step_limit_hits);
    archive->Number("skipped_updates", &window_.skipped_updates);
    archive->Number("color_loss", &window_.color_loss);
    archive->Number("identity_loss", &window_.identity_loss);
    for (int c = 0; c < 3; ++c) {
      const std::string channel = std::to_string(c);
      archive->Number("target_sum_" + channel, &window_.target_sum[c]);
      archive->Number("target_square_sum_" + channel, &window_.target_square_sum[c]);
    }
    archive->Number("windows", &num_windows_);
    color_.Serialize("color_", archive);
    identity_.Serialize("identity_", archive);
    archive->Number("flat_color_loss", &flat_color_loss_);
    archive->Number("unstable_iterations", &unstable_iterations_);
    archive->Number("explained_contrast", &explained_contrast_);
  }

 private:
  struct Window {
    int64_t iterations = 0;
    int64_t rays = 0;
    int64_t step_limit_hits = 0;
    int64_t skipped_updates = 0;
    double color_loss = 0;  // sums over rays
    double identity_loss = 0;
    double target_sum[3] = {};
    double target_square_sum[3] = {};

    void Add(const std::vector<BatchRay>& new_rays, const BatchTotals& batch, int64_t skipped);
    double FlatColorLoss() const;
  };

  // A loss that should stay below a bound.
  struct Watched {
    double loss = std::numeric_limits<double>::infinity();  // of the last window
    double bound = 0;
    int windows_above = 0;  // in a row, without falling

    void Update(double new_loss, double new_bound);

    template <typename Archive>
    void Serialize(const std::string& prefix, Archive* archive) {
      archive->Number(prefix + "loss_of_window", &loss);
      archive->Number(prefix + "bound", &bound);
      archive->Number(prefix + "windows_above", &windows_above);
    }
  };

  void Judge(int64_t iteration);
  [[noreturn]] void FailColorLoss(int64_t iteration) const;
  [[noreturn]] void FailIdentityLoss(int64_t iteration) const;

  Window window_;
  int64_t num_windows_ = 0;
  Watched color_, identity_;
  double flat_color_loss_ = 0;  // of the last window
  int64_t unstable_iterations_ = 0;
  double explained_contrast_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace semfoam
