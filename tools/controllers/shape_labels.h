// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "foam/segment/scene_segments.h"

#include <filesystem>
#include <vector>

namespace semfoam {

// Labels for foams that were trained without masks, by the shape of their surfaces.

// Throws UserError naming the field where it is not 0 to 1.
void RequireGranularity(double granularity);

// Replaces all labels of a model, the content of `foam_path`, by those of its segments
// (FindSceneSegments): plane_1, plane_2, ..., thing_1, ..., by what photos show of them. Returns
// the segments; segment i has the label model->labels[i + 1], of id i + 1. Throws UserError where
// the granularity is not 0 to 1, where the model does not know what photos show of its cells, and
// where it has no surface.
std::vector<SceneSegment> LabelByShape(double granularity,
                                       const std::filesystem::path& foam_path,
                                       Model* model);

}  // namespace semfoam
