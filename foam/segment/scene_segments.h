// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/model.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// A part of a scene that was found without masks.
struct SceneSegment {
  // Whether it is a dominant plane, such as a table with its legs, a floor or a wall; else a thing.
  bool is_plane = false;
  // Its part of what photos show of all surfaces, 0..1.
  double share = 0;
  // Number of its cells.
  int64_t cells = 0;
};

struct SceneSegments {
  // Planes first, then things; the largest share first.
  std::vector<SceneSegment> segments;
  // [sites] Index into `segments`; kNoSegment: air, or matter that is connected to no segment.
  std::vector<int32_t> segment_of_cell;
};

inline constexpr int32_t kNoSegment = -1;

// Cuts a scene into segments by the shape of its surfaces alone, for trainings without masks:
//
// 1. Planes that hold 4 % of what photos show, or more (FindDominantPlanes).
// 2. What lies on a plane within two and a half radii of its cells is left out for now, for things
//    that stand on a table are connected with each other by it; so are cells that hardly a ray
//    shows. What remains falls into pieces. One that is more than 12 (1 - g) % of what photos show
//    is a heap, or a thing and what it leans against, and is cut along concave creases
//    (CutAtCreases); a smaller one is a thing.
// 3. A piece half of which looks where a plane beside it does, within four radii of its cells, is a
//    rough part of that plane. One of which four fifths are behind the plane, such as the legs of a
//    table, belongs to it, too.
// 4. Cells of surfaces that are left join the segment with which they share the largest faces, and
//    all other solid cells the nearest one through matter.
//
// `granularity` g, 0 to 1: how finely to cut. It also sets the least concavity of creases, 0.6 (1 -
// g)^2, and the share of what photos show below which a region joins its neighbour, 0.3 (1 - g) %,
// at least 0.05 %.
//
// `delaunay` is the triangulation of the model's sites and the guards. The result depends on the
// model and the granularity alone. CHECKs that the model has all CellStatistics, and the range.
SceneSegments FindSceneSegments(const Model& model, const Delaunay& delaunay, double granularity);

}  // namespace semfoam
