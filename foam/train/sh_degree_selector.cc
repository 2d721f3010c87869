// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/sh_degree_selector.h"

#include "foam/model/sh_degree.h"
#include "foam/train/training_evaluation.h"

#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

// By how much the squared error must be greater without a degree that pays.
constexpr double kWorthwhile = 0.01;

}  // namespace

ShDegreeSelector::ShDegreeSelector(const TrainingOptions& options,
                                   const TrainingSchedule& schedule,
                                   const CameraCells& camera_cells,
                                   TrainingPixels* pixels,
                                   TrainingState* state,
                                   TrainingDevice* device)
    : options_(options),
      schedule_(schedule),
      camera_cells_(camera_cells),
      pixels_(pixels),
      state_(state),
      device_(device) {}

void ShDegreeSelector::Update(int64_t iteration) {
  const int degree = state_->foam.sh_degree;
  const double interval = options_.sh_degree_interval;
  if (is_settled_ || schedule_.RunFraction(iteration) < interval * (degree + 1)) return;
  if (degree > 0 && pixels_->HasProbes() && !HighestDegreePays()) {
    Settle(degree - 1);
  } else if (degree < options_.sh_degree) {
    SetDegree(degree + 1);
  } else {
    Settle(degree);
  }
}

ProbeUse ShDegreeSelector::ProbeUseAt(int64_t iteration) const {
  // What late_rays makes of later iterations is not known where seconds decide.
  const int64_t early = schedule_.early_iterations();
  const bool unknown = options_.seconds > 0 && iteration > early;
  const int64_t known = unknown ? early : iteration;
  // Degree d can be found not to pay from d + 1 intervals on, and the last is settled after it has
  // been tried; each iteration takes one of these steps at the most.
  const int degrees = options_.sh_degree;
  const double interval = options_.sh_degree_interval;
  if (schedule_.RunFraction(known - degrees) >= interval * (degrees + 1))
    return ProbeUse::kTrainedOn;
  if (!unknown && schedule_.RunFraction(iteration) < 2 * interval) return ProbeUse::kSetApart;
  return ProbeUse::kUnknown;
}

void ShDegreeSelector::Restore() {
  if (is_settled_) pixels_->ReleaseProbes();
}

bool ShDegreeSelector::HighestDegreePays() const {
  const std::vector<BatchRay> rays =
      pixels_->ProbeRays(camera_cells_.Find(pixels_->training_views()));
  const int degree = state_->foam.sh_degree;
  const double without = SquaredError(rays, device_->Render(rays, degree - 1)),
               with = SquaredError(rays, device_->Render(rays, degree));
  VLOG(1) << "SH degree " << degree << ": without it, the squared error on photos not seen is "
          << without / with << " times as large";
  return without >= (1 + kWorthwhile) * with;
}

void ShDegreeSelector::SetDegree(int degree) {
  if (degree == state_->foam.sh_degree) return;
  device_->Download();
  ChangeShDegree(degree, &state_->foam);
  state_->optimizer->ChangeShDegree(degree);
  device_->Upload();
}

void ShDegreeSelector::Settle(int degree) {
  SetDegree(degree);
  is_settled_ = true;
  pixels_->ReleaseProbes();
}

}  // namespace semfoam
