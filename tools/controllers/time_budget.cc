// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/time_budget.h"

#include "foam/device/cpu_device.h"
#include "foam/train/training_schedule.h"
#include "foam/util/elapsed_time.h"
#include "tools/controllers/object_photos.h"
#include "tools/controllers/presets.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <memory>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// The time of a ray grows with about this power of the sites (foam/README.md: render/backward, and
// more of it where all sites are updated).
constexpr double kSitesPower = 0.3;
// Triangulating, labelling and writing a site at the end, in the time of a ray.
constexpr double kClosedSite = 7;

constexpr int64_t kPilotRays = 200'000;
constexpr int kPilotViews = 8;

// From `a` to `b` in ratios.
double Between(double a, double b, double share) { return a * std::pow(b / a, share); }

double ToDigits(double value, int digits) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - digits + 1);
  return std::round(value / unit) * unit;
}

// A few of the training views, spread over all of them.
class FewViews final : public TrainingViews {
 public:
  explicit FewViews(const TrainingViews& views) : views_(views) {
    std::vector<int> all;
    for (int view = 0; view < views.NumViews(); ++view) {
      if (!views.IsHeldOut(view)) all.push_back(view);
    }
    const int count = std::min(kPilotViews, static_cast<int>(all.size()));
    for (int i = 0; i < count; ++i) chosen_.push_back(all[i * all.size() / count]);
  }

  int NumViews() const override { return static_cast<int>(chosen_.size()); }
  int Width(int view) const override { return views_.Width(chosen_[view]); }
  int Height(int view) const override { return views_.Height(chosen_[view]); }
  bool IsHeldOut(int) const override { return false; }
  Eigen::Vector3d Origin(int view) const override { return views_.Origin(chosen_[view]); }
  bool Ray(int view, int x, int y, TrainingRay* ray) const override {
    return views_.Ray(chosen_[view], x, y, ray);
  }
  bool RayDirection(int view, int x, int y, Eigen::Vector3f* direction) const override {
    return views_.RayDirection(chosen_[view], x, y, direction);
  }
  const BlockContrast* Contrast(int view) const override { return views_.Contrast(chosen_[view]); }
  bool HasLabels(int view) const override { return views_.HasLabels(chosen_[view]); }
  bool HoldsPixels() const override { return views_.HoldsPixels(); }
  int64_t CacheBytes() const override { return views_.CacheBytes(); }
  int MostOpenViews() const override { return views_.MostOpenViews(); }
  std::unique_ptr<ViewPixels> OpenView(int view) const override {
    return views_.OpenView(chosen_[view]);
  }
  bool RayOf(int view, int x, int y, const PixelValue& value, TrainingRay* ray) const override {
    return views_.RayOf(chosen_[view], x, y, value, ray);
  }

 private:
  const TrainingViews& views_;
  std::vector<int> chosen_;
};

}  // namespace

TrainingOptions OptionsOnPresetLine(int64_t num_rays) {
  CHECK_GT(num_rays, 0);
  std::vector<TrainingOptions> presets;
  for (const EnumName<Quality>& quality : kQualityNames) {
    presets.push_back(OptionsForQuality(quality.value));
  }
  const auto above = std::find_if(
      presets.begin() + 1, presets.end() - 1, [&](const auto& o) { return o.num_rays > num_rays; });
  const TrainingOptions& a = *std::prev(above);
  const TrainingOptions& b = *above;
  const double share = std::min(
      std::log(double(num_rays) / double(a.num_rays)) / std::log(double(b.num_rays) / a.num_rays),
      1.0);
  TrainingOptions options = share < 0.5 ? a : b;
  options.num_rays = num_rays;
  options.final_sites =
      std::max(64, static_cast<int>(ToDigits(Between(a.final_sites, b.final_sites, share), 3)));
  // Below a thousand rays, the fixed cost of an iteration is noticeable.
  options.rays_per_iteration =
      std::max(4,
               static_cast<int>(
                   std::lround(Between(a.rays_per_iteration, b.rays_per_iteration, share) / 256))) *
      256;
  options.densify_events = std::max(
      1, static_cast<int>(std::lround(Between(a.densify_events, b.densify_events, share))));
  return options;
}

TrainingTimeModel::TrainingTimeModel(const TrainingViews& views,
                                     const std::vector<SeedPoint>& seeds,
                                     int num_classes,
                                     const Device& device,
                                     double seconds,
                                     RankGroup* ranks)
    : views_(views) {
  const FewViews few(views);
  for (int64_t rays = kPilotRays;;) {
    const TrainingOptions options = OptionsOnPresetLine(rays);
    const auto thinning = std::chrono::steady_clock::now();
    const std::vector<SeedPoint> starting_seeds = StartingSeeds(seeds, options);
    seeding_ = SecondsSince(thinning);
    const auto begin = std::chrono::steady_clock::now();
    TrainingHooks hooks;
    hooks.device = device;
    if (ranks != nullptr) {
      hooks.make_device = [ranks](TrainingState* state) {
        return MakeCpuTrainingDevice(state, ranks);
      };
    }
    const TrainingSummary summary =
        TrainFoam(few, starting_seeds, num_classes, options, std::move(hooks));
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
    const double growth = std::pow(options.final_sites, kSitesPower);
    learning_ = summary.last.seconds / double(summary.last.rays) / growth;
    // Of few small views the rays cost less than what goes with them; a ray that is looked at costs
    // less than one that is learned from.
    looking_ = std::min(
        learning_,
        (taken.count() - summary.last.seconds) / double(StatisticsRays(few, rays)) / growth);
    // All ranks train the same.
    seeding_ = FromFirstRank(ranks, seeding_);
    learning_ = FromFirstRank(ranks, learning_);
    looking_ = FromFirstRank(ranks, looking_);
    const int64_t more = RaysOnPresetLine(seconds);
    if (rays != kPilotRays || more < 2 * kPilotRays) break;
    rays = more;
  }
  for (int view = 0; num_classes > 0 && view < views.NumViews(); ++view) {
    const double width = views.Width(view), height = views.Height(view);
    const double reduced = std::min(1.0, kObjectSamplesAlongEdge / std::max(width, height));
    object_rays_ += reduced * width * reduced * height;
  }
}

double TrainingTimeModel::TrainingSeconds(const TrainingOptions& options) const {
  const double early = options.late_rays > 0 ? options.densify_until : 1;
  const double rays = early * double(options.num_rays) + double(options.late_rays);
  const int64_t looked_at =
      EvaluationRays(views_, options.num_rays) + StatisticsRays(views_, options.num_rays);
  return (learning_ * rays + looking_ * double(looked_at)) *
         std::pow(options.final_sites, kSitesPower);
}

double TrainingTimeModel::ClosingSeconds(const TrainingOptions& options) const {
  return (learning_ * kClosedSite * options.final_sites + looking_ * object_rays_) *
         std::pow(options.final_sites, kSitesPower);
}

int64_t TrainingTimeModel::RaysOnPresetLine(double seconds) const {
  double low = std::log(1e3), high = std::log(1e13);
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    const TrainingOptions options = OptionsOnPresetLine(std::llround(std::exp(middle)));
    (TrainingSeconds(options) + ClosingSeconds(options) < seconds ? low : high) = middle;
  }
  return std::llround(ToDigits(std::exp(low), 3));
}

}  // namespace semfoam
