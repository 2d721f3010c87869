// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/sh_degree.h"
#include "foam/train/trainer_internal.h"
#include "foam/train/training_evaluation.h"
#include "foam/util/random.h"

#include <algorithm>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr uint64_t kShProbePurpose = 0x4a3;

// When the colour of a cell may begin to change with direction in one degree more: degree d at d
// times kShRaise. One such time later the degree must have paid, or it is taken out again and the
// question is settled: without it, the colour's squared error must be greater by kShWorthwhile, on
// pixels of photos that training has not seen until then (every kProbeViews-th; there it can only
// be right, and not learned by heart).
constexpr double kShRaise = 0.1;
constexpr double kShWorthwhile = 0.01;
constexpr int kShProbeRays = 16384;
constexpr int kProbeViews = 16;
constexpr int kFewestViewsToProbe = 8;

}  // namespace

// Sets the photos apart on which the SH degree is settled, if there is anything to settle and
// there are photos to spare.
void Trainer::ChooseViews() {
  std::vector<int> train = views_to_train_on_, probe;
  if (options_.sh_degree > 0 && !options_.fixed_sh_degree && train.size() >= kFewestViewsToProbe) {
    for (size_t k = 0; k < train.size(); ++k) {
      if (k % kProbeViews == kFewestViewsToProbe / 2) probe.push_back(train[k]);
    }
    std::erase_if(train, [&](int view) { return std::count(probe.begin(), probe.end(), view); });
  }
  pixels_ = PixelRange(views_, train);
  probe_pixels_ = PixelRange(views_, probe);
}

void Trainer::SettleShDegree(int degree) {
  SetShDegree(degree);
  sh_degree_is_settled_ = true;
  if (probe_pixels_.size() == 0) return;
  pixels_ = PixelRange(views_, views_to_train_on_);
  probe_pixels_ = {};
}

void Trainer::SetShDegree(int degree) {
  if (degree == state_.foam.sh_degree) return;
  device_->Download();
  ChangeShDegree(degree, &state_.foam);
  state_.optimizer->ChangeShDegree(degree);
  device_->Upload();
}

// The pixels on which the SH degree is settled.
std::vector<ViewPixel> Trainer::ProbePixels() const {
  std::vector<ViewPixel> pixels;
  if (probe_pixels_.size() == 0) return pixels;
  for (int i = 0; i < kShProbeRays; ++i) {
    CounterRandom random(options_.random_seed, kShProbePurpose, i);
    pixels.push_back(
        probe_pixels_.At(static_cast<int64_t>(random.Uniform() * probe_pixels_.size())));
  }
  return pixels;
}

// The SH degree is settled in the course of the run, and then the probes are trained on as well: in
// between, an iteration may draw from either range.
std::vector<int> Trainer::RangesAt(int64_t iteration) const {
  // What late_rays makes of later iterations is not known where seconds decide.
  const int64_t early = schedule_.early_iterations();
  const bool unknown = options_.seconds > 0 && iteration > early;
  const int64_t known = unknown ? early : iteration;
  // Degree d can be found not to pay from d times kShRaise on, and the last is settled after it has
  // been tried; each iteration takes one of these steps at the most.
  const int degrees = options_.sh_degree;
  if (schedule_.RunFraction(known - degrees) >= kShRaise * (degrees + 1)) return {kAllViews};
  if (!unknown && schedule_.RunFraction(iteration) < 2 * kShRaise) return {kAllButProbes};
  return {kAllButProbes, kAllViews};
}

// Whether the highest degree makes enough of a difference to photos not seen.
bool Trainer::ShDegreePays() const {
  std::vector<BatchRay> rays;
  const std::vector<uint32_t> start_cells = StartCellsWith(views_to_train_on_);
  const std::vector<ViewPixel> pixels = ProbePixels();
  for (size_t i = 0; i < pixels.size(); ++i) {
    const PixelValue* const value = cache_ ? &cache_->Kept(i) : nullptr;
    const uint32_t start = start_cells[pixels[i].view];
    if (const auto ray = PixelAsRay(views_, pixels[i], value, start)) rays.push_back(*ray);
  }
  const int degree = state_.foam.sh_degree;
  const double without = SquaredError(rays, device_->Render(rays, degree - 1)),
               with = SquaredError(rays, device_->Render(rays, degree));
  VLOG(1) << "SH degree " << degree << ": without it, the squared error on photos not seen is "
          << without / with << " times as large";
  return without >= (1 + kShWorthwhile) * with;
}

void Trainer::ChooseShDegreeIfDue() {
  const int degree = state_.foam.sh_degree;
  if (sh_degree_is_settled_ || RunFraction() < kShRaise * (degree + 1)) return;
  const bool can_probe = probe_pixels_.size() > 0;
  if (degree > 0 && can_probe && !ShDegreePays()) {
    SettleShDegree(degree - 1);
  } else if (degree < options_.sh_degree) {
    SetShDegree(degree + 1);
  } else {
    SettleShDegree(degree);
  }
}

}  // namespace semfoam
