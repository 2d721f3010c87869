// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/foam.h"
#include "foam/pixel_range.h"
#include "foam/ray_batch.h"
#include "foam/ray_tracer.h"
#include "foam/training_topology.h"
#include "foam/training_views.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

namespace semfoam {

// Sum over the rays of the squared difference between the colour over white and the target's, as
// `shading` shows the foam. With `shown_classes`, also which class each ray shows, as ViewRenderer
// reads it. The same on any number of threads.
double SquaredError(const Foam& foam,
                    const WalkGeometry<float>& geometry,
                    const CellShading<float>& shading,
                    const std::vector<BatchRay>& rays,
                    std::vector<int32_t>* shown_classes);

// NaN = not known.
struct HeldOutQuality {
  double psnr = NAN;  // dB, mean over the views
  double miou = NAN;  // see LabelAgreement: against the views' classes
};

// A grid over the held-out views (EvaluationStride), view by view.
std::vector<ViewPixel> EvaluationPixels(const TrainingViews& views);

// Over the EvaluationPixels. `value_of(k)` is what the photo stores of the k-th of them, for views
// that do not hold their pixels; empty for others. `start_cells` per view: near its camera.
HeldOutQuality EvaluateHeldOut(const TrainingViews& views,
                               const std::function<const PixelValue*(size_t k)>& value_of,
                               const Foam& foam,
                               const TrainingTopology& topology,
                               const CellShading<float>& shading,
                               const std::vector<uint32_t>& start_cells);

}  // namespace semfoam
