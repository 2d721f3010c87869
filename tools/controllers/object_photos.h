// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"

#include <filesystem>

namespace semfoam {

// Number of sampled pixels along a photo's longer side.
inline constexpr double kObjectSamplesAlongEdge = 96;

// Finds the photos that show each object, and fills ObjectInfo::photos. `scene` must be made of
// `model`, which was read from `foam_path`.
//
// A pixel shows the object of the cell in which the transmittance of its ray falls to 1/2, the
// depth of depth maps; none if that cell belongs to no object. Samples a grid of pixels, 96 along a
// photo's longer side, of all photos, held out or not; each counts for its share of the photo's
// pixels, at the size used in training. The result is the same on any number of threads. Throws
// UserError naming `foam_path` when a photo's record holds no valid camera.
void FindPhotosOfObjects(const Model& model,
                         const std::filesystem::path& foam_path,
                         ExportableScene* scene);

}  // namespace semfoam
