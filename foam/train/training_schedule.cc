// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/training_schedule.h"

#include "foam/train/schedule.h"

#include <algorithm>
#include <cmath>

namespace semfoam {
namespace {

// Fractions of the run. Colours settle before matter forms, and the mean colour before its change
// with direction.
constexpr double kDensityWarmUp = 0.1;
constexpr double kShWarmUp = 0.2;

// FitToSeconds measures the last one of so many parts of the iterations until densify_until.
constexpr int64_t kMeasuredPart = 4;

// The time of a ray that is only looked at, in that of one that is learned from (foam/README.md,
// Speed).
constexpr double kLookedAtShare = 0.3;

enum class ViewSet {
  kHeldOut,
  kTraining,
  // Those of kTraining that have labels.
  kLabelled,
};

bool IsOf(const TrainingViews& views, int view, ViewSet set) {
  if (views.IsHeldOut(view) || set == ViewSet::kHeldOut) {
    return views.IsHeldOut(view) && set == ViewSet::kHeldOut;
  }
  return set == ViewSet::kTraining || views.HasLabels(view);
}

// Of the views of a set, every so many pixels in either direction.
int64_t GridRays(const TrainingViews& views, ViewSet set, int stride) {
  int64_t rays = 0;
  for (int view = 0; view < views.NumViews(); ++view) {
    if (!IsOf(views, view, set)) continue;
    rays += int64_t{(views.Width(view) + stride - 1) / stride} *
            ((views.Height(view) + stride - 1) / stride);
  }
  return rays;
}

// The least of what EvaluationStride and of what StatisticsStride and LabelStride give.
constexpr int kLeastEvaluationStride = 4, kLeastStatisticsStride = 2;

// Returns the most rays of one evaluation: all evaluations together cast a twentieth of the rays of
// a short run. 2^14 rays estimate the mean squared error to some percent.
int64_t MostEvaluationRays(int64_t num_rays) {
  return std::clamp(num_rays / (20 * kNumEvaluations), int64_t{1} << 14, int64_t{1} << 20);
}

// Returns the most rays for the cells' statistics. An eighth of the rays of a short run meets each
// of its cells in some pixels.
int64_t MostStatisticsRays(int64_t num_rays) {
  return std::clamp(num_rays / 8, int64_t{1} << 18, int64_t{1} << 24);
}

// Returns the least stride from `stride` on with no more than `most` rays, but one a view.
int GridStride(const TrainingViews& views, ViewSet set, int stride, int64_t most) {
  most = std::max<int64_t>(most, views.NumViews());
  while (GridRays(views, set, stride) > most) ++stride;
  return stride;
}

}  // namespace

int EvaluationStride(const TrainingViews& views, int64_t num_rays) {
  return GridStride(views, ViewSet::kHeldOut, kLeastEvaluationStride, MostEvaluationRays(num_rays));
}

int StatisticsStride(const TrainingViews& views, int64_t num_rays) {
  return GridStride(
      views, ViewSet::kTraining, kLeastStatisticsStride, MostStatisticsRays(num_rays));
}

int LabelStride(const TrainingViews& views, int64_t num_rays) {
  return GridStride(
      views, ViewSet::kLabelled, kLeastStatisticsStride, MostStatisticsRays(num_rays));
}

int64_t EvaluationRays(const TrainingViews& views, int64_t num_rays) {
  return kNumEvaluations * GridRays(views, ViewSet::kHeldOut, EvaluationStride(views, num_rays));
}

int64_t StatisticsRays(const TrainingViews& views, int64_t num_rays) {
  return GridRays(views, ViewSet::kTraining, StatisticsStride(views, num_rays));
}

TrainingSchedule::TrainingSchedule(const TrainingOptions& options)
    : options_(options), late_rays_(options.late_rays) {
  const auto iterations = [&](int64_t rays) {
    return (rays + options.rays_per_iteration - 1) / options.rays_per_iteration;
  };
  planned_iterations_ = iterations(options.num_rays);
  early_iterations_ =
      static_cast<int64_t>(std::ceil(options.densify_until * double(planned_iterations_)));
  num_iterations_ = options.late_rays > 0 ? early_iterations_ + iterations(options.late_rays)
                                          : planned_iterations_;
}

double TrainingSchedule::RunFraction(int64_t iteration) const {
  if (iteration <= early_iterations_ || num_iterations_ == planned_iterations_) {
    return double(iteration) / double(planned_iterations_);
  }
  const double early = double(early_iterations_) / double(planned_iterations_);
  return early + (1 - early) * double(iteration - early_iterations_) /
                     double(num_iterations_ - early_iterations_);
}

LearningRates TrainingSchedule::Rates(int64_t iteration) const {
  const TrainingOptions& o = options_;
  const double at = RunFraction(iteration);
  const auto cosine = [&](double initial, double warm_up, double end) {
    return static_cast<float>(CosineSchedule{initial, initial * o.final_rate, warm_up, end}.At(at));
  };
  LearningRates rates;
  rates.position = PositionsMove(iteration) ? cosine(o.position_rate, 0, o.freeze_positions) : 0.f;
  rates.density = cosine(o.density_rate, kDensityWarmUp, 1);
  rates.sh_dc = cosine(o.color_rate, 0, 1);
  rates.sh_rest = cosine(o.color_rate * o.sh_factor, kShWarmUp, 1);
  rates.color_gradient = cosine(o.color_gradient_rate, kShWarmUp, 1);
  rates.identity = cosine(o.identity_rate, 0, 1);
  rates.classifier = static_cast<float>(o.classifier_rate);
  return rates;
}

bool TrainingSchedule::NeedsSeconds(int64_t iteration) const {
  const int64_t measured = early_iterations_ / kMeasuredPart;
  return options_.seconds > 0 && measured > 0 &&
         (iteration == early_iterations_ - measured || iteration == early_iterations_);
}

void TrainingSchedule::FitToSeconds(const TrainingViews& views,
                                    int64_t iteration,
                                    double seconds,
                                    double seconds_evaluating) {
  if (!NeedsSeconds(iteration)) return;
  if (iteration != early_iterations_) {
    pace_begin_ = seconds - seconds_evaluating;
    return;
  }
  const double planned = double(planned_iterations_ - early_iterations_);
  const double pace = std::max(seconds - seconds_evaluating - pace_begin_, 1e-9) /
                      double(early_iterations_ / kMeasuredPart);  // an iteration
  // Looking at rays costs less than learning from them; evaluations have shown how much.
  const double looked_at =
      double(EvaluationRays(views, options_.num_rays)) * RunFraction(iteration);
  const double look = looked_at > 0 ? seconds_evaluating / looked_at
                                    : kLookedAtShare * pace / options_.rays_per_iteration;
  const double to_look_at =
      double(EvaluationRays(views, options_.num_rays) + StatisticsRays(views, options_.num_rays)) -
      looked_at;
  const double affordable = (options_.seconds - seconds - look * to_look_at) / pace;
  // Some end there must be, to settle in; and a pace mistaken by far must not last for ever.
  const auto late = static_cast<int64_t>(std::clamp(affordable, 0.1 * planned, 10 * planned));
  if (late == 0) return;
  num_iterations_ = early_iterations_ + late;
  late_rays_ = late * options_.rays_per_iteration;
}

}  // namespace semfoam
