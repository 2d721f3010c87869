// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/training_log.h"

#include "foam/util/elapsed_time.h"

#include <cmath>

namespace semfoam {

double TrainingLog::Seconds() const { return SecondsSince(begin_); }

void TrainingLog::AddLoss(const RayLossTerms<double>& mean_loss) {
  loss_sum_.color += mean_loss.color;
  loss_sum_.opacity += mean_loss.opacity;
  loss_sum_.quantile += mean_loss.quantile;
  loss_sum_.identity += mean_loss.identity;
  loss_sum_.distance += mean_loss.distance;
  ++loss_count_;
}

void TrainingLog::AddTvLoss(double tv_loss) {
  tv_sum_ += tv_loss;
  ++tv_count_;
}

void TrainingLog::EndIteration(int64_t num_rays) {
  ++progress_.iteration;
  progress_.rays += num_rays;
}

void TrainingLog::SetQuality(const HeldOutQuality& quality) {
  progress_.held_out_psnr = quality.psnr;
  progress_.held_out_miou = quality.miou;
}

void TrainingLog::ReportReading(int done, int total, const Receiver& receiver) const {
  TrainingProgress reading = progress_;
  reading.photos_read = done;
  reading.photos_to_read = total;
  reading.seconds = Seconds();
  receiver(reading);
}

bool TrainingLog::ReportIsDue() const { return Seconds() - last_report_ > 1; }

void TrainingLog::Report(const TrainingSchedule& schedule,
                         const Foam& foam,
                         const Receiver& receiver) {
  progress_.num_iterations = schedule.num_iterations();
  progress_.sites = foam.NumSites();
  progress_.seconds = Seconds();
  const double done = schedule.RunFraction(progress_.iteration);
  const double learning = progress_.seconds - seconds_reading_;
  progress_.seconds_left = done > 0 ? learning * (1 - done) / done : NAN;
  if (loss_count_ > 0) {
    progress_.color_loss = loss_sum_.color / loss_count_;
    progress_.opacity_loss = loss_sum_.opacity / loss_count_;
    progress_.quantile_loss = loss_sum_.quantile / loss_count_;
    progress_.identity_loss = foam.HasSemantics() ? loss_sum_.identity / loss_count_ : NAN;
    progress_.distance_loss = loss_sum_.distance / loss_count_;
    loss_sum_ = {};
    loss_count_ = 0;
  }
  if (tv_count_ > 0) {
    progress_.tv_loss = tv_sum_ / tv_count_;
    tv_sum_ = 0;
    tv_count_ = 0;
  }
  last_report_ = progress_.seconds;
  reports_.push_back(progress_);
  if (receiver) receiver(progress_);
}

void TrainingLog::RestartClock() {
  last_report_ = progress_.seconds;
  begin_ = Clock::now() -
           std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(last_report_));
}

}  // namespace semfoam
