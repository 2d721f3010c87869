// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/training_evaluation.h"

#include "foam/image/metrics.h"
#include "foam/train/training_rays.h"
#include "foam/train/training_schedule.h"

#include <algorithm>

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
        const double difference = seen - rays[i].target.color[c];
        of_block += difference * difference;
      }
    }
    error += of_block;
  }
  return error;
}

std::vector<ViewPixel> EvaluationPixels(const TrainingViews& views) {
  const int stride = EvaluationStride(views);
  std::vector<ViewPixel> pixels;
  for (int view = 0; view < views.NumViews(); ++view) {
    if (!views.IsHeldOut(view)) continue;
    for (int y = 0; y < views.Height(view); y += stride) {
      for (int x = 0; x < views.Width(view); x += stride) pixels.push_back({view, x, y});
    }
  }
  return pixels;
}

HeldOutQuality EvaluateHeldOut(const TrainingViews& views,
                               const std::function<const PixelValue*(size_t k)>& value_of,
                               const std::vector<uint32_t>& start_cells,
                               const Foam& foam,
                               TrainingDevice* device) {
  double sum = 0;
  int count = 0;
  LabelAgreement agreement;
  const std::vector<ViewPixel> pixels = EvaluationPixels(views);
  for (size_t k = 0; k < pixels.size();) {
    const int view = pixels[k].view;
    std::vector<BatchRay> rays;
    for (; k < pixels.size() && pixels[k].view == view; ++k) {
      const PixelValue* const value = value_of ? value_of(k) : nullptr;
      if (const auto ray = PixelAsRay(views, pixels[k], value, start_cells[view]))
        rays.push_back(*ray);
    }
    if (rays.empty()) continue;
    const std::vector<RenderedRay> rendered = device->Render(rays, foam.sh_degree);
    const double error = SquaredError(rays, rendered) / (3.0 * rays.size());
    sum += -10 * std::log10(std::max(error, 1e-12));
    ++count;
    if (!foam.HasSemantics()) continue;
    for (size_t i = 0; i < rays.size(); ++i) {
      agreement.Add(rays[i].target.class_index, rendered[i].class_index);
    }
  }
  HeldOutQuality quality;
  if (count > 0) quality.psnr = sum / count;
  quality.miou = agreement.MeanIou();
  return quality;
}

}  // namespace semfoam
