// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/object_surface.h"

#include <cstdint>

namespace semfoam {

// Reduces a surface to at most `target_faces` triangles, by quadric error (Garland and Heckbert
// 1997; OpenMesh's decimater). Collapses edges onto one of their ends, so that the remaining
// vertices keep their positions, colours, confidences and order; a face has the mean of its
// corners. Makes only collapses that keep a closed 2-manifold and rotate no face by 60 degrees or
// more; when there are none left, the result has more than `target_faces` triangles. Triangles may
// intersect each other afterwards. vertex_tet and triangle_cells of the result are empty. CHECKs
// that `target_faces` is positive and the surface a manifold.
ObjectSurface Decimate(const ObjectSurface& surface, int64_t target_faces);

}  // namespace semfoam
