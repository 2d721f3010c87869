// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Prepares the cells of a model for export: all of an ExportableScene but its objects, of which it
// has none, and the colours that these spread inwards. CHECKs the sizes of the model's arrays.
ExportableScene MakeSceneCells(const Model& model, const ExportableSceneOptions& options);

// Returns whether each cell, guards included, holds the centre of a camera of the model.
std::vector<uint8_t> CellsWithCameras(const Model& model, const ExportableScene& scene);

}  // namespace semfoam
