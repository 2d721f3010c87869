// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/object_surface.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Extracts a part of the surface of ExtractSurface: the faces around `object.cells`, which are some
// of the object's cells, towards all cells that are not in the object. `inside`
// [delaunay.num_cells] says which are in it.
ObjectSurface ExtractFaces(const ExportableScene& scene,
                           const ObjectInfo& object,
                           const std::vector<uint8_t>& inside);

// Counts far vertices (CountFarVertices) by the distances of all vertices of a surface from the
// sites whose cells meet there.
int64_t CountFarDistances(const std::vector<double>& distances);

}  // namespace semfoam
