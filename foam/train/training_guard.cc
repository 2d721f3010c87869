// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/training_guard.h"

#include "foam/render/ray_loss.h"
#include "foam/util/error.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace semfoam {
namespace {

// Iterations of a window.
constexpr int64_t kWindow = 50;
// Windows in a row that a loss may not be above its bound.
constexpr int kLostWindows = 4;
// Of rays that hit the step limit, and of skipped updates per ray.
constexpr double kLargestShare = 0.01;
// The bound of the colour loss in losses of a flat colour, and its least value. Where these are
// large, the factors are 1.25 and 1.05 of the squared error.
constexpr double kFlatColorFactor = 1.18;
constexpr double kFlatColorFactorAtEnd = 1.037;
constexpr double kLeastColorBound = 0.012;
constexpr double kIdentityBound = 2;
// A loss is falling if it is less than this share of the loss of the window before.
constexpr double kFalling = 0.8;
// Below this the photos have no contrast to explain: a standard deviation of 1 / 64.
constexpr double kLeastFlatColorLoss = 1.0 / 8192;

// Ends the run with one sentence made of `parts`.
template <typename... Parts>
[[noreturn]] void Fail(int64_t iteration, const Parts&... parts) {
  throw UserError(
      "Training is lost at iteration ",
      iteration,
      ": ",
      parts...,
      "; lower learning rates (position_rate, density_rate, color_rate, "
      "sh_factor, color_gradient_rate, identity_rate, classifier_rate) or weights would be right.");
}

}  // namespace

void TrainingGuard::Window::Add(const std::vector<BatchRay>& new_rays,
                                const BatchTotals& batch,
                                int64_t skipped) {
  ++iterations;
  rays += static_cast<int64_t>(new_rays.size());
  step_limit_hits += batch.step_limit_hits;
  skipped_updates += skipped;
  color_loss += batch.mean_loss.color * new_rays.size();
  identity_loss += batch.mean_loss.identity * new_rays.size();
  for (const BatchRay& ray : new_rays) {
    for (int c = 0; c < 3; ++c) {
      const double target = ray.target.color[c];
      target_sum[c] += target;
      target_square_sum[c] += target * target;
    }
  }
}

double TrainingGuard::Window::FlatColorLoss() const {
  double variance = 0;
  for (int c = 0; c < 3; ++c) {
    const double mean = target_sum[c] / rays;
    variance += std::max(0.0, target_square_sum[c] / rays - mean * mean) / 3;
  }
  // No less than the mean loss of such photos, as the loss is concave in the square.
  return ColorLoss(variance);
}

void TrainingGuard::BoundedLoss::Update(double new_loss, double new_bound) {
  const bool is_first = std::isinf(loss);
  const bool is_falling = new_loss < kFalling * loss;
  loss = new_loss;
  bound = new_bound;
  windows_above = loss > bound && !is_first && !is_falling ? windows_above + 1 : 0;
}

void TrainingGuard::FailColorLoss(int64_t iteration) const {
  Fail(iteration,
       "the colour loss of the last ",
       kWindow,
       " iterations, ",
       color_.loss,
       ", is worse than the ",
       flat_color_loss_,
       " of photos in one flat colour");
}

void TrainingGuard::FailIdentityLoss(int64_t iteration) const {
  Fail(iteration,
       "the identity loss of the last ",
       kWindow,
       " iterations, ",
       identity_.loss,
       ", is worse than the 1 of guessing");
}

void TrainingGuard::Watch(int64_t iteration,
                          const std::vector<BatchRay>& rays,
                          const BatchTotals& batch,
                          double tv_loss,
                          int64_t skipped_updates) {
  const RayLossTerms<double>& loss = batch.mean_loss;
  for (const auto& [value, name] : {std::pair(loss.color, "colour"),
                                    {loss.opacity, "opacity"},
                                    {loss.quantile, "quantile"},
                                    {loss.identity, "identity"},
                                    {loss.distance, "distance"},
                                    {tv_loss, "total variation"}}) {
    if (!std::isfinite(value)) Fail(iteration, "the ", name, " loss is not finite");
  }
  window_.Add(rays, batch, skipped_updates);
  if (window_.iterations < kWindow) return;
  Judge(iteration);
  window_ = {};
}

void TrainingGuard::Judge(int64_t iteration) {
  const Window& w = window_;
  if (w.step_limit_hits > kLargestShare * w.rays) {
    Fail(iteration, w.step_limit_hits, " of the last ", w.rays, " rays hit the walk's step limit");
  }
  if (w.skipped_updates > kLargestShare * w.rays) {
    Fail(iteration,
         w.skipped_updates,
         " updates in the last ",
         kWindow,
         " iterations had gradients that are not finite");
  }
  ++num_windows_;
  flat_color_loss_ = w.FlatColorLoss();
  color_.Update(w.color_loss / w.rays,
                std::max(kFlatColorFactor * flat_color_loss_, kLeastColorBound));
  identity_.Update(w.identity_loss / w.rays, kIdentityBound);
  explained_contrast_ =
      flat_color_loss_ > kLeastFlatColorLoss ? 1 - color_.loss / flat_color_loss_ : NAN;
  if (color_.windows_above >= kLostWindows) FailColorLoss(iteration);
  if (identity_.windows_above >= kLostWindows) FailIdentityLoss(iteration);
  if (color_.windows_above > 0 || identity_.windows_above > 0) unstable_iterations_ += kWindow;
}

void TrainingGuard::Finish(int64_t iteration) const {
  if (num_windows_ <= kLostWindows) return;
  const double color_bound = std::max(kFlatColorFactorAtEnd * flat_color_loss_, kLeastColorBound);
  if (color_.loss > color_bound) FailColorLoss(iteration);
  if (identity_.loss > identity_.bound) FailIdentityLoss(iteration);
}

}  // namespace semfoam
