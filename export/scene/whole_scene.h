// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"

namespace semfoam {

// Name of the only object of MakeWholeScene.
inline constexpr char kWholeSceneName[] = "scene";

// Prepares a model for export with all of its matter as one object, whatever its labels: by the
// rules of MakeExportableScene, but with connected components down to a tenth of
// `min_component_share` of the largest, for things of a scene stand apart. The scene has no object
// where nothing is matter. Takes the model by value, because it replaces its classes.
ExportableScene MakeWholeScene(Model model, ExportableSceneOptions options = {});

}  // namespace semfoam
