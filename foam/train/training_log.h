// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/render/ray_loss.h"
#include "foam/train/trainer.h"
#include "foam/train/training_evaluation.h"
#include "foam/train/training_schedule.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <vector>

// Records the progress of a run, in iterations, rays, seconds and losses.

namespace semfoam {

// Counts the iterations of a run, measures its time, averages losses between reports, and keeps all
// reports.
class TrainingLog {
 public:
  // Receives a report.
  using Receiver = std::function<void(const TrainingProgress&)>;

  // Starts the clock.
  TrainingLog() = default;

  // Returns the number of iterations done.
  int64_t iteration() const { return progress_.iteration; }
  // Returns the number of rays cast.
  int64_t rays() const { return progress_.rays; }
  // Returns the seconds since the start of the run; for a resumed run, those until the checkpoint
  // plus those since RestartClock().
  double Seconds() const;

  // Adds the losses of an iteration to the next report's means.
  void AddLoss(const RayLossTerms<double>& mean_loss);
  void AddTvLoss(double tv_loss);
  // Ends an iteration that cast `num_rays` rays.
  void EndIteration(int64_t num_rays);
  // Sets the quality for the following reports.
  void SetQuality(const HeldOutQuality& quality);
  // Excludes these seconds, in which no iteration ran, from the estimate of the seconds left.
  void SetSecondsReading(double seconds) { seconds_reading_ = seconds; }

  // Sends, without keeping it, a report of `done` of `total` photos read.
  void ReportReading(int done, int total, const Receiver& receiver) const;
  // Returns whether the last report is more than a second old.
  bool ReportIsDue() const;
  // Keeps a report, starts new means, and sends the report unless `receiver` is empty.
  void Report(const TrainingSchedule& schedule, const Foam& foam, const Receiver& receiver);

  // Returns the last report; before the first one, the progress at the start.
  const TrainingProgress& progress() const { return progress_; }
  const std::vector<TrainingProgress>& reports() const { return reports_; }

  // Stores the seconds so far among the numbers, for Serialize.
  void StampSeconds() { progress_.seconds = Seconds(); }
  // Sets the clock to the seconds that Serialize has read.
  void RestartClock();

  // Describes the numbers, and the reports (checkpoint_state.h).
  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Number("iteration", &progress_.iteration);
    archive->Number("rays", &progress_.rays);
    archive->Number("seconds", &progress_.seconds);
    archive->Number("seconds_left", &progress_.seconds_left);
    archive->Number("reported_color_loss", &progress_.color_loss);
    archive->Number("reported_opacity_loss", &progress_.opacity_loss);
    archive->Number("reported_quantile_loss", &progress_.quantile_loss);
    archive->Number("reported_identity_loss", &progress_.identity_loss);
    archive->Number("reported_tv_loss", &progress_.tv_loss);
    archive->Number("reported_distance_loss", &progress_.distance_loss);
    archive->Number("held_out_psnr", &progress_.held_out_psnr);
    archive->Number("held_out_miou", &progress_.held_out_miou);
    archive->Number("color_loss", &loss_sum_.color);
    archive->Number("opacity_loss", &loss_sum_.opacity);
    archive->Number("quantile_loss", &loss_sum_.quantile);
    archive->Number("identity_loss", &loss_sum_.identity);
    archive->Number("distance_loss", &loss_sum_.distance);
    archive->Number("losses", &loss_count_);
    archive->Number("tv_loss", &tv_sum_);
    archive->Number("tv_losses", &tv_count_);
  }
  template <typename Archive>
  void SerializeReports(size_t num_reports, Archive* archive) {
    static_assert(sizeof(TrainingProgress) == 15 * 8, "reports are saved as they lie");
    archive->Array("reports", &reports_, num_reports);
  }

 private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point begin_ = Clock::now();
  // Counts and quality are current; the rest is that of the last report.
  TrainingProgress progress_;
  std::vector<TrainingProgress> reports_;
  // Time of the last report, in seconds since begin_.
  double last_report_ = 0;
  double seconds_reading_ = 0;
  // Sums since the last report, and their number of iterations.
  RayLossTerms<double> loss_sum_;
  double tv_sum_ = 0;
  int64_t loss_count_ = 0;
  int64_t tv_count_ = 0;
};

}  // namespace semfoam
