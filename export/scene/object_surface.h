// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/util/ids.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Display values.
using Color8 = std::array<uint8_t, 3>;
// Converts display values in 0..1; clips values outside.
Color8 ToColor8(const Eigen::Vector3f& display);

// The closed surface of one object, as triangles in the world (COLMAP) frame.
struct ObjectSurface {
  LabelId object_id = kNoObject;
  std::string object_name;

  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;  // counter-clockwise seen from outside

  // Colours and confidences. Method `cells`: a face has those of the object's cell behind it; a
  // vertex has the mean of the object's cells that meet there, with colours weighted by
  // color_weight. Method `smooth`: a vertex has those of the object's cell behind it; a face has
  // the mean of its corners.
  std::vector<Color8> face_color;
  std::vector<float> face_confidence;
  std::vector<Color8> vertex_color;
  std::vector<float> vertex_confidence;

  // Whether photos look at the vertex from outside, for method `smooth` only.
  std::vector<uint8_t> vertex_shown;
  // Whether the vertex lies in the plane of another object that this one stands on, and whether in
  // that of a flat part (FindFlatParts); for method `smooth` only.
  std::vector<uint8_t> vertex_in_contact;
  std::vector<uint8_t> vertex_flat;

  // Origin of the surface, for method `cells` only: the tetrahedron whose circumcentre the vertex
  // is, and the cells on the inner and the outer side of the triangle (the outer one may be a
  // guard).
  std::vector<uint32_t> vertex_tet;
  std::vector<std::array<uint32_t, 2>> triangle_cells;
};

// Extracts the faces between the object's cells and all other cells. For every Delaunay edge (i, j)
// with i in the object and j not, the circumcentres of the tetrahedra around the edge, in cyclic
// order, are the corners of one flat convex polygon; it is cut into triangles from its
// lowest-numbered corner.
//
// The result is a closed, oriented 2-manifold, whatever the labels and however degenerate the
// sites:
// - A vertex is a tetrahedron, never a position. In a tetrahedron with corners inside and outside,
//   the edges between them, and with them the polygons, form one single cycle (of 3 or 4), so one
//   fan of faces meets there.
// - A polygon's side is a facet with corners inside and outside; it has exactly two such edges, so
//   exactly two polygons meet there, in opposite directions.
// - A polygon's diagonal joins two tetrahedra that share an edge but no facet; no other polygon
//   holds both, so it is no edge of the surface a second time.
// No hull facet is involved, because no real site lies on the hull. Corners of cospherical sites
// coincide: such surfaces have triangles without area, but no holes. Two neighbouring objects share
// the same triangles, with opposite orientation.
ObjectSurface ExtractSurface(const ExportableScene& scene, const ObjectInfo& object);

// Gives every face of the surface the mean colour and confidence of its corners.
void ShowVerticesOnFaces(ObjectSurface* surface);

// Counts the far vertices of a `cells` surface: those farther than eight times the median from the
// sites whose cells meet there. They belong to cells next to wide empty space. They are only
// reported, never moved, so that the surface stays exact.
int64_t CountFarVertices(const ExportableScene& scene, const ObjectSurface& surface);

}  // namespace semfoam
