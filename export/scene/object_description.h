// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"

namespace semfoam {

// Measures an object by its cells: volume, surface area, centroid, bounding box, confidence,
// cavities and genus of ObjectInfo, whose components must be counted already. The area and the
// centroid are those of the closed surface of ExtractSurface, the latter by the divergence theorem,
// so both are exact for the union of the object's cells.
void DescribeObject(const ExportableScene& scene, ObjectInfo* object);

}  // namespace semfoam
