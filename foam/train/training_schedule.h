// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/optim/optimizer.h"
#include "foam/train/training_options.h"

#include <cstdint>

namespace semfoam {

// Rays that TrainFoam casts without learning from them: over the run for the progress of the
// held-out quality, and after it for the cells' statistics.
int64_t EvaluationRays(const TrainingViews& views);
int64_t StatisticsRays(const TrainingViews& views);

inline constexpr int kNumEvaluations = 20;  // of the held-out views, over the run

// Pixels between two of those rays, in either direction: a few, and more where large photos have
// more pixels than a foam has to show.
int EvaluationStride(const TrainingViews& views);
int StatisticsStride(const TrainingViews& views);

// How many iterations a run has and where in the run each of them is, which decides the learning
// rates and all that happens once.
class TrainingSchedule {
 public:
  // The options must outlive it.
  explicit TrainingSchedule(const TrainingOptions& options);

  int64_t num_iterations() const { return num_iterations_; }
  // Those up to densify_until.
  int64_t early_iterations() const { return early_iterations_; }
  // As given, or as chosen by FitToSeconds.
  int64_t late_rays() const { return late_rays_; }

  // After so many iterations, 0 at the start and 1 at the end. Iterations beyond densify_until
  // count for less or more than the others where late_rays says so.
  double RunFraction(int64_t iteration) const;
  bool PositionsMove(int64_t iteration) const {
    return RunFraction(iteration) < options_.freeze_positions;
  }
  LearningRates Rates(int64_t iteration) const;

  // To be called after every iteration, with the seconds since training began and those of them
  // that went into evaluations. Where densification ends, the sites are all there and an iteration
  // costs what it will cost to the end: with TrainingOptions::seconds, what time is left decides
  // how many more there are.
  void FitToSeconds(const TrainingViews& views,
                    int64_t iteration,
                    double seconds,
                    double seconds_evaluating);

  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Number("num_iterations", &num_iterations_);
    archive->Number("late_rays", &late_rays_);
    archive->Number("pace_begin", &pace_begin_);
  }

 private:
  const TrainingOptions& options_;
  int64_t planned_iterations_;  // by num_rays
  int64_t early_iterations_;    // of these, up to densify_until; late_rays may replace the rest
  int64_t num_iterations_;
  int64_t late_rays_;
  double pace_begin_ = 0;  // seconds of learning before the pace was measured
};

}  // namespace semfoam
