// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/foam.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Some opaque cells are seen through others only: far cells behind the outline of a thing, which a
// new view may see past it. What little light they send to a photo makes up for errors of what is
// before them, so that they may have any colour: brown polygons hang in the white around a wooden
// tankard.

// A cell that no training ray reaches with more of its light than this is hidden.
inline constexpr float kHiddenTransmittance = 0.1f;

// Gives each hidden opaque cell (CellOpacity) one colour in all directions: the harmonic extension,
// over the Voronoi graph, of the mean colours of the opaque cells that are not hidden. It passes
// through hidden cells whether opaque or not. Also writes it to `mean_color`. Densities and
// identities stay, and so do cells from which no way leads to a seen one. Of the cells that no ray
// meets, the larger ones are hidden; one smaller than half of the cells beside it that rays meet
// may lie between the rays that were cast. Returns the number of cells changed.
//
// `delaunay` is the triangulation of the sites and the guards; `transmittance` [N] and `mean_color`
// [N] are those of MeasureCells. The result does not depend on the number of threads.
int64_t RecolorHiddenCells(const Delaunay& delaunay,
                           const std::vector<float>& transmittance,
                           Foam* foam,
                           std::vector<Eigen::Vector3f>* mean_color);

}  // namespace semfoam
