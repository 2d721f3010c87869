// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/scene_plan.h"
#include "plugin/photo/photo_survey.h"

#include <vector>

namespace semfoam {

// Returns the places at which each photo is surveyed, [photos]: those of ScenePlan::tracks in it,
// in their order. The samples of one track are as far from each other, in space, as the pixels of
// the training photo that sees it at the lowest resolution.
std::vector<std::vector<SurveyPlace>> SurveyPlacesOf(const ScenePlan& plan);

}  // namespace semfoam
