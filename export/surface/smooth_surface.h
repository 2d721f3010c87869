// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/scene/object_surface.h"
#include "export/surface/contact_planes.h"
#include "export/surface/surface_box.h"

#include <vector>

#include <Eigen/Geometry>

namespace semfoam {

// Extracts an iso-surface of the object's occupancy (1 at its sites, 0 at all others) on the
// Delaunay tetrahedra, smoothed without blunting edges (surface_smoothing.h). `cells` must be
// ExtractSurface(scene, object); the result is in the same frame, and its vertex_tet and
// triangle_cells are empty.
//
// A vertex is a Delaunay edge from a site i of the object to a site j outside of it. It starts at
// the centroid of the Voronoi face of i and j, has the colour and confidence of cell i, and is
// drawn inwards along the normal to where a little of the light has ended (optical depth 0.07,
// at most i's radius, averaged over the vertices around it), because training leaves thin matter
// before what photos show. Dents of single cells are filled, and bumps go where light passes the
// cell (FairOutliers). In smoothing it is moved from there by at most nine tenths of i's radius and
// of half the edge, and at the end it is between the two sites, so that the two sides of a wall of
// one cell stay apart; spikes that are left then are cut (CutSpikes). Spikes into empty space are
// cut off first: a corner of the faces is moved to within three times the radius of its cells from
// their sites. The surface encloses as much as the faces then do, less what it was drawn in by.
//
// With a `box` (normalised frame) the object is cut at it: `object` and `cells` must hold only the
// cells whose sites are in it (CellsInBox), and a vertex on an edge that leaves the box lies in its
// side and stays there. So it does in the planes of `contacts`, where the edge leads through one
// into what no photo shows, not far from the site: things are flat below where they stand; in the
// plane such vertices are smoothed, as the line where the object meets it is as ragged as the
// cells. `object` and `cells` must hold only cells whose sites are on the object's side
// (CellsUpToContacts).
//
// The result is a closed, oriented 2-manifold for any labels and any degenerate sites, because its
// faces follow from the indices of the triangulation, not from positions:
// - A tetrahedron with one corner on one side and three on the other has one triangle, between the
//   three edges from that corner; with two and two it has a quadrangle between four edges, cut in
//   two along a diagonal.
// - A side of these lies in a facet with corners on both sides. Such a facet has exactly two edges
//   that are vertices, which make one side; and, being no hull facet (no real site is on the hull),
//   two tetrahedra, on opposite sides of it. So two faces meet in the side, and in opposite
//   directions, as both have the object's sites behind them.
// - A diagonal joins two edges without a common site, which determine their tetrahedron: it is no
//   side of any other face.
// - The tetrahedra around an edge form one cycle in which neighbours share a facet; so do the faces
//   around a vertex: one fan.
//
// Then edges between faces that are nearly in one plane are flipped where that makes these more
// even (EvenTriangles), which changes no vertex. With every vertex on its edge, each triangle that
// was not flipped would lie in its tetrahedron and none could meet another. So where faces
// intersect, their vertices are moved onto their edges (to the middle, or to where a spike would
// end), and no edge beside them is flipped, until no faces intersect except those that cannot be
// moved (tetrahedra without volume, from cospherical sites).
ObjectSurface ExtractSmoothSurface(const ExportableScene& scene,
                                   const ObjectInfo& object,
                                   const ObjectSurface& cells,
                                   const Eigen::AlignedBox3d& box = WholeSpace(),
                                   const std::vector<ContactPlane>& contacts = {});

}  // namespace semfoam
