// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/sim3.h"
#include "foam/model/model.h"

namespace semfoam {

// Transforms a model to another COLMAP frame: cells, colours and cameras, so that every camera
// still sees the same. Without a rotation only the frame and the cameras change. With one the sites
// turn within the normalised frame, rounded to float, which the sites' order follows (SortSites),
// and the view-dependent colours (ShRotation) and colour gradients turn with them. The guard sites
// stay, so the outermost cells end elsewhere, far away.
void TransformModel(const Sim3& target_from_source, Model* model);

}  // namespace semfoam
