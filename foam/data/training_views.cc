// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/data/training_views.h"

#include <glog/logging.h>

namespace semfoam {

std::unique_ptr<ViewPixels> TrainingViews::OpenView(int /*view*/) const {
  LOG(FATAL) << "these views hold their pixels";
}

bool TrainingViews::RayOf(
    int /*view*/, int /*x*/, int /*y*/, const PixelValue& /*value*/, TrainingRay* /*ray*/) const {
  LOG(FATAL) << "these views hold their pixels";
}

}  // namespace semfoam
