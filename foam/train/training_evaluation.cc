// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/training_evaluation.h"

#include "foam/image/metrics.h"
#include "foam/train/training_rays.h"
#include "foam/util/elapsed_time.h"

#include <algorithm>
#include <chrono>

#include <glog/logging.h>

namespace semfoam {

double SquaredError(const std::vector<BatchRay>& rays, const std::vector<RenderedRay>& rendered) {
  CHECK_EQ(rays.size(), rendered.size());
  // Of many rays, the sum of sums is the more exact one.
  constexpr size_t kBlock = 256;
  double error = 0;
  for (size_t begin = 0; begin < rays.size(); begin += kBlock) {
    double of_block = 0;
    for (size_t i = begin; i < std::min(rays.size(), begin + kBlock); ++i) {
      for (int c = 0; c < 3; ++c) {
        const double seen = std::min(rendered[i].color[c], 1.f);
        const double difference = ColorDifference(seen, rays[i].target, c);
        of_block += difference * difference;
      }
    }
    error += of_block;
  }
  return error;
}

HeldOutEvaluator::HeldOutEvaluator(const TrainingViews& views,
                                   const TrainingSchedule& schedule,
                                   const TrainingPixels& pixels,
                                   const CameraCells& camera_cells,
                                   const TrainingState& state,
                                   TrainingDevice* device)
    : views_(views),
      schedule_(schedule),
      pixels_(pixels),
      camera_cells_(camera_cells),
      state_(state),
      device_(device) {}

std::optional<HeldOutQuality> HeldOutEvaluator::EvaluateIfDue(int64_t iteration) {
  const auto due = static_cast<int>(schedule_.RunFraction(iteration) * kNumEvaluations);
  if (due <= num_evaluations_) return {};
  num_evaluations_ = due;
  const auto begin = std::chrono::steady_clock::now();
  const HeldOutQuality quality = Evaluate();
  seconds_ += SecondsSince(begin);
  return quality;
}

HeldOutQuality HeldOutEvaluator::Evaluate() const {
  double sum = 0;
  int count = 0;
  LabelAgreement agreement;
  const std::vector<uint32_t> start_cells =
      camera_cells_.Find(SelectViews(views_, /*held_out=*/true));
  const std::vector<ViewPixel> pixels = pixels_.HeldOutPixels();
  for (size_t k = 0; k < pixels.size();) {
    const int view = pixels[k].view;
    std::vector<BatchRay> rays;
    for (; k < pixels.size() && pixels[k].view == view; ++k) {
      const PixelValue* const value = pixels_.HeldOutValue(k);
      if (const auto ray = PixelAsRay(views_, pixels[k], value, start_cells[view]))
        rays.push_back(*ray);
    }
    if (rays.empty()) continue;
    const std::vector<RenderedRay> rendered = device_->Render(rays, state_.foam.sh_degree);
    const double error = SquaredError(rays, rendered) / (3.0 * rays.size());
    sum += -10 * std::log10(std::max(error, 1e-12));
    ++count;
    if (!state_.foam.HasSemantics()) continue;
    for (size_t i = 0; i < rays.size(); ++i) {
      agreement.Add(ClassIndex{rays[i].target.class_index}, ClassIndex{rendered[i].class_index});
    }
  }
  HeldOutQuality quality;
  if (count > 0) quality.psnr = sum / count;
  quality.miou = agreement.MeanIou();
  return quality;
}

}  // namespace semfoam
