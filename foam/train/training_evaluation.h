// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/pixel_range.h"
#include "foam/data/training_views.h"
#include "foam/model/foam.h"
#include "foam/optim/training_device.h"
#include "foam/render/ray_batch.h"
#include "foam/render/ray_caster.h"

#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

namespace semfoam {

// Sum over the rays of the squared difference between the colour that each shows, at most white,
// and its target's.
double SquaredError(const std::vector<BatchRay>& rays, const std::vector<RenderedRay>& rendered);

// NaN = not known.
struct HeldOutQuality {
  double psnr = NAN;  // dB, mean over the views
  double miou = NAN;  // see LabelAgreement: against the views' classes
};

// A grid over the held-out views (EvaluationStride), view by view.
std::vector<ViewPixel> EvaluationPixels(const TrainingViews& views);

// Over the EvaluationPixels. `value_of(k)` is what the photo stores of the k-th of them, for views
// that do not hold their pixels; empty for others. `start_cells` per view: where its camera is.
// Of `foam` only its SH degree and whether it has classes are asked; what it shows is `device`'s.
HeldOutQuality EvaluateHeldOut(const TrainingViews& views,
                               const std::function<const PixelValue*(size_t k)>& value_of,
                               const std::vector<uint32_t>& start_cells,
                               const Foam& foam,
                               TrainingDevice* device);

}  // namespace semfoam
