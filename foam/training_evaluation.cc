// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/training_evaluation.h"

#include "foam/classifier.h"
#include "foam/metrics.h"
#include "foam/parallel.h"
#include "foam/training_rays.h"
#include "foam/training_schedule.h"
#include "foam/view_renderer.h"

#include <algorithm>
#include <numeric>
#include <span>

namespace semfoam {

double SquaredError(const Foam& foam,
                    const WalkGeometry<float>& geometry,
                    const CellShading<float>& shading,
                    const std::vector<BatchRay>& rays,
                    std::vector<int32_t>* shown_classes) {
  constexpr int64_t kBlock = 256;
  std::vector<double> errors((rays.size() + kBlock - 1) / kBlock, 0.0);
  if (shown_classes != nullptr) shown_classes->assign(rays.size(), kUnlabelled);
  ParallelForBlocks(rays.size(), kBlock, [&](int64_t begin, int64_t end) {
    const std::span<RayTrace> traces = ThreadTraces(end - begin);
    for (int64_t i = begin; i < end; ++i) {
      traces[i - begin].origin = rays[i].origin;
      traces[i - begin].direction = rays[i].direction;
      traces[i - begin].start_cell = rays[i].start_cell;
    }
    TraceRays(geometry, shading, static_cast<float>(-std::log(kTransmittanceCutoff)), traces);
    std::vector<float> logits(foam.num_classes);
    for (int64_t i = begin; i < end; ++i) {
      const RayComposite<float>& composite = traces[i - begin].composite;
      for (int c = 0; c < 3; ++c) {
        const double shown = std::min(composite.color[c] + composite.Transmittance(), 1.f);
        const double difference = shown - rays[i].target.color[c];
        errors[begin / kBlock] += difference * difference;
      }
      if (shown_classes == nullptr || !foam.HasSemantics() || composite.Opacity() < 0.5f) continue;
      ClassLogits(foam, composite.identity, logits.data());
      (*shown_classes)[i] = ArgmaxSoftmax(logits).class_index;
    }
  });
  return std::accumulate(errors.begin(), errors.end(), 0.0);
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
                               const Foam& foam,
                               const TrainingTopology& topology,
                               const CellShading<float>& shading,
                               const std::vector<uint32_t>& start_cells) {
  double sum = 0;
  int count = 0;
  LabelAgreement agreement;
  const std::vector<ViewPixel> pixels = EvaluationPixels(views);
  for (size_t k = 0; k < pixels.size();) {
    const int view = pixels[k].view;
    const uint32_t start = topology.CellAt(views.Origin(view), start_cells[view]);
    std::vector<BatchRay> rays;
    for (; k < pixels.size() && pixels[k].view == view; ++k) {
      const PixelValue* const value = value_of ? value_of(k) : nullptr;
      if (const auto ray = PixelAsRay(views, pixels[k], value, start)) rays.push_back(*ray);
    }
    if (rays.empty()) continue;
    std::vector<int32_t> shown;
    const double error =
        SquaredError(foam, topology.geometry(), shading, rays, &shown) / (3.0 * rays.size());
    sum += -10 * std::log10(std::max(error, 1e-12));
    ++count;
    if (!foam.HasSemantics()) continue;
    for (size_t i = 0; i < rays.size(); ++i) agreement.Add(rays[i].target.class_index, shown[i]);
  }
  HeldOutQuality quality;
  if (count > 0) quality.psnr = sum / count;
  quality.miou = agreement.MeanIou();
  return quality;
}

}  // namespace semfoam
