// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/surface/surface_smoothing.h"

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

namespace semfoam {

// A part of a surface that lies in a plane, as far as the size of its cells lets one tell.
struct FlatPart {
  // The normal points out of the object.
  Eigen::Hyperplane<double, 3> plane;
  // Distance from the plane up to which vertices belong to the part, > 0.
  double tolerance = 0;
};

// A surface with what is known of its vertices; all arrays are [positions].
struct SurfaceInPhotos {
  const Triangles& triangles;
  const std::vector<Eigen::Vector3d>& positions;
  // Whether photos look at a vertex.
  const std::vector<uint8_t>& shown;
  // Radius of the cell behind a vertex, in the unit of the positions.
  const std::vector<double>& radii;
};

// Finds the planes that photos show much of a surface to lie in: table tops, walls, floors, sides
// of boxes. One after the other, the most frequent direction of the normals is taken, and the plane
// that most of the vertices with such normals lie near (FitPlane). It is kept if
// - its vertices have kLeastFlatShare of the shown area and kLeastFlatOfDirection of what has such
//   normals: leaves of a plant lie in many planes, each with few of them,
// - and a polynomial of fourth order over the plane explains less than kMostCurved of their squared
//   distances from it: what is curved, like a ball or the ring on top of a donut, has large parts
//   near planes, too, but the noise of cells has no such shape.
// The result does not depend on the number of threads. CHECKs that the sizes agree.
std::vector<FlatPart> FindFlatParts(const SurfaceInPhotos& surface);

inline constexpr double kLeastFlatShare = 0.05;
inline constexpr double kLeastFlatOfDirection = 0.4;
inline constexpr double kMostCurved = 0.6;

// Moves the vertices of flat parts into their planes, those of two parts into the line where these
// meet; vertices farther away than half of the tolerance move by less, and those beyond it or
// `is_fixed` [positions] stay. Vertices that photos do not show move too, if their normals agree.
// Returns which vertices [positions] lie within the tolerance of a part. CHECKs that the sizes
// agree.
std::vector<uint8_t> Flatten(const std::vector<FlatPart>& parts,
                             const Triangles& triangles,
                             const std::vector<double>& radii,
                             const std::vector<uint8_t>& is_fixed,
                             std::vector<Eigen::Vector3d>* positions);

}  // namespace semfoam
