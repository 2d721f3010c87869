// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/object_surface.h"

#include <cstdint>

namespace semfoam {

// The surface with at most `target_faces` triangles, by quadric error (Garland and Heckbert 1997;
// OpenMesh's decimater): edges are collapsed onto one of their ends, so the vertices that stay have
// their places, colours and confidences, and are numbered as before; a face shows the mean of its
// corners. Only collapses that leave a closed 2-manifold and turn no face by 60 degrees or more are
// made; where these run out the result has more triangles than asked for. Triangles may come to
// intersect each other. vertex_tet and
// triangle_cells are empty afterwards. CHECKs that `target_faces` is positive and the surface a
// manifold.
ObjectSurface Decimate(const ObjectSurface& surface, int64_t target_faces);

}  // namespace semfoam
