// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/optim/optimizer.h"
#include "foam/train/training_options.h"

#include <cstdint>

namespace semfoam {

// Returns the number of rays that TrainFoam casts without training on them in a run of `num_rays`
// rays: during the run for the held-out quality, and after it for the cells' statistics.
int64_t EvaluationRays(const TrainingViews& views, int64_t num_rays);
int64_t StatisticsRays(const TrainingViews& views, int64_t num_rays);

// Number of evaluations of the held-out views over the run.
inline constexpr int kNumEvaluations = 20;

// Returns the distance in pixels between two of those rays, in x and y: a few, and more for large
// photos, which have more pixels than the evaluation needs, and in short runs, so that looking
// takes a small part of their time.
int EvaluationStride(const TrainingViews& views, int64_t num_rays);
int StatisticsStride(const TrainingViews& views, int64_t num_rays);
// Likewise of the rays whose pixels' labels are spread after the run (label_spreading.h): those of
// the views that have labels.
int LabelStride(const TrainingViews& views, int64_t num_rays);

// Computes the number of iterations of a run, and the time of each as a fraction of the run, which
// determines the learning rates and when single events happen.
class TrainingSchedule {
 public:
  // The options must outlive this object.
  explicit TrainingSchedule(const TrainingOptions& options);

  int64_t num_iterations() const { return num_iterations_; }
  // Returns the number of iterations up to densify_until.
  int64_t early_iterations() const { return early_iterations_; }
  // Returns TrainingOptions::late_rays, or the number that FitToSeconds has chosen.
  int64_t late_rays() const { return late_rays_; }

  // Returns the fraction of the run that is done after `iteration` iterations, 0 at the start and 1
  // at the end. Iterations after densify_until count for less or more than the others if late_rays
  // is set.
  double RunFraction(int64_t iteration) const;
  bool PositionsMove(int64_t iteration) const {
    return RunFraction(iteration) < options_.freeze_positions;
  }
  LearningRates Rates(int64_t iteration) const;

  // Chooses, with TrainingOptions::seconds, the number of remaining iterations by the time that is
  // left. Does so when densification ends: from then on the number of sites, and so the time of an
  // iteration, stays. Must be called after every iteration that NeedsSeconds, with the seconds
  // since training began and those of them that evaluations took.
  void FitToSeconds(const TrainingViews& views,
                    int64_t iteration,
                    double seconds,
                    double seconds_evaluating);

  // Returns whether FitToSeconds measures or decides after `iteration` iterations.
  bool NeedsSeconds(int64_t iteration) const;

  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Number("num_iterations", &num_iterations_);
    archive->Number("late_rays", &late_rays_);
    archive->Number("pace_begin", &pace_begin_);
  }

 private:
  const TrainingOptions& options_;
  // Number of iterations by num_rays.
  int64_t planned_iterations_;
  // Of these, the iterations up to densify_until; late_rays may replace the others.
  int64_t early_iterations_;
  int64_t num_iterations_;
  int64_t late_rays_;
  // Seconds of training before the pace was measured.
  double pace_begin_ = 0;
};

}  // namespace semfoam
