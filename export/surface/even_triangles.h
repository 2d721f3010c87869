// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/surface/surface_smoothing.h"

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Makes the triangles of a closed surface more even, and returns them: flips edges whose two
// triangles are nearly in one plane (within 15 degrees) where the angles opposite to it are more
// than 180 degrees together, over and over, so that flat parts approach a Delaunay triangulation
// (Lawson 1977). No edge is flipped whose triangles have a corner in `is_fixed` ([positions]). The
// result is a closed 2-manifold of the same vertices and the same topology; its triangles may
// intersect. CHECKs that the surface is a 2-manifold.
Triangles EvenTriangles(const Triangles& triangles,
                        const std::vector<Eigen::Vector3d>& positions,
                        const std::vector<uint8_t>& is_fixed);

}  // namespace semfoam
