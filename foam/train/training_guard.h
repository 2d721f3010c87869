// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/render/ray_batch.h"

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

// Detects training runs that cannot succeed any more.

namespace semfoam {

// Checks the losses of a training run and throws UserError when the run is lost, so that no useless
// foam is written. A run is lost
//
// - at once, when a loss term is not finite: gradients that are not finite change no parameter, so
//   what overflows now overflows again;
// - when, in a window of 50 iterations, more than 1 % of the rays hit the walk's step limit, or
//   more updates were skipped than 1 % of the number of rays. One stuck cell is below that;
// - when the colour loss of four windows in a row is above its bound and is not falling, that is,
//   is 0.8 times that of the window before or more. The bound is 1.18 times the loss of photos in
//   one flat colour (ColorLoss of the variance of their pixels), which is 1.25 times its square
//   where it is large, and at least 0.012, an error of 0.2, as photos that are black or white
//   throughout have no variance. A foam that learns is below the bound within its first hundred
//   iterations or falls fast; even photos of noise, from which nothing can be learned, are rendered
//   as their mean;
// - likewise, when the identity loss stays above 2; guessing has 1;
// - when a run of five windows or more ends with a loss above its bound, falling or not; the factor
//   of the flat colour is 1.037 then.
//
// The criteria depend neither on the scene's scale nor on batch size, loss weights and number of
// rays.
class TrainingGuard {
 public:
  // Takes the results of the last iteration: its rays with their targets, its losses and counts,
  // the total variation (0 where none was computed), and the number of cells whose gradient was not
  // finite. Throws UserError, one sentence naming the iteration and the quantity, when the run is
  // lost.
  void Watch(int64_t iteration,
             const std::vector<BatchRay>& rays,
             const BatchTotals& batch,
             double tv_loss,
             int64_t skipped_updates);

  // Judges the end of the run, after its last iteration. Throws as Watch does.
  void Finish(int64_t iteration) const;

  // Returns the number of iterations, in whole windows after the first, whose losses were above
  // those bounds: a run that ended well with more than 0 has recovered.
  int64_t unstable_iterations() const { return unstable_iterations_; }

  // Returns 1 - colour loss / that of one flat colour, over the last whole window: the share of the
  // photos' contrast that the foam shows, at most 1. NaN before the first window and where photos
  // have no contrast.
  double explained_contrast() const { return explained_contrast_; }

  // Describes the state (checkpoint_state.h).
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
  // Sums over the iterations of a window.
  struct Window {
    int64_t iterations = 0;
    int64_t rays = 0;
    int64_t step_limit_hits = 0;
    int64_t skipped_updates = 0;
    // Sums over the rays: of the losses, and of the targets' colours and their squares.
    double color_loss = 0;
    double identity_loss = 0;
    double target_sum[3] = {};
    double target_square_sum[3] = {};

    void Add(const std::vector<BatchRay>& new_rays, const BatchTotals& batch, int64_t skipped);
    // Returns at least the colour loss of the photos' mean colour: ColorLoss of the targets'
    // variance.
    double FlatColorLoss() const;
  };

  // A loss that should stay below a bound.
  struct BoundedLoss {
    // Mean over the rays of the last window.
    double loss = std::numeric_limits<double>::infinity();
    double bound = 0;
    // Number of windows in a row in which the loss was above the bound and not falling.
    int windows_above = 0;

    void Update(double new_loss, double new_bound);

    template <typename Archive>
    void Serialize(const std::string& prefix, Archive* archive) {
      archive->Number(prefix + "loss_of_window", &loss);
      archive->Number(prefix + "bound", &bound);
      archive->Number(prefix + "windows_above", &windows_above);
    }
  };

  // Judges a whole window.
  void Judge(int64_t iteration);
  [[noreturn]] void FailColorLoss(int64_t iteration) const;
  [[noreturn]] void FailIdentityLoss(int64_t iteration) const;

  // The current window.
  Window window_;
  // Number of finished windows.
  int64_t num_windows_ = 0;
  BoundedLoss color_;
  BoundedLoss identity_;
  // Window::FlatColorLoss of the last whole window.
  double flat_color_loss_ = 0;
  int64_t unstable_iterations_ = 0;
  double explained_contrast_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace semfoam
