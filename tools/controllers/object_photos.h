// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"

#include <filesystem>

namespace semfoam {

// Of the pixels that are looked at, so many lie along a photo's longer side.
inline constexpr double kObjectSamplesAlongEdge = 96;

// Finds the photos that show each object, and fills ObjectInfo::photos. `scene` must be made of
// `model`, which was read from `foam_path`.
//
// A pixel shows the object whose cell its ray is in where the transmittance falls through 1/2,
// where depth maps have their depth; nothing, where that cell is no object's. Looked at is a grid
// of pixels, 96 along a photo's longer side, of all photos, held out or not; each stands for its
// share of the photo's pixels, at the size that was trained on. The same on any number of threads.
// Throws UserError naming `foam_path` when a photo's record holds no valid camera.
void FindPhotosOfObjects(const Model& model,
                         const std::filesystem::path& foam_path,
                         ExportableScene* scene);

}  // namespace semfoam
