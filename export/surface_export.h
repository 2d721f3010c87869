// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/exportable_scene.h"
#include "export/label_choice.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

using Color8 = std::array<uint8_t, 3>;  // display values
// From 0..1; what is outside is cut.
Color8 ToColor8(const Eigen::Vector3f& display);

// The closed surface of one object, as triangles in the world (COLMAP) frame.
struct ObjectSurface {
  int32_t object_id = 0;
  std::string object_name;

  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;  // counter-clockwise seen from outside

  // `cells`: what a face shows is what the object's cell behind it is; what a vertex shows is the
  // mean of the object's cells that meet there, colours by how well the photos saw them
  // (color_weight). `smooth`: what a vertex shows is what the object's cell behind it is; what a
  // face shows is the mean of its corners.
  std::vector<Color8> face_color;
  std::vector<float> face_confidence;
  std::vector<Color8> vertex_color;
  std::vector<float> vertex_confidence;

  // `cells` alone, where it comes from: the tetrahedron whose circumcentre the vertex is, and the
  // cells on the inner and the outer side of the triangle (the outer one may be a guard).
  std::vector<uint32_t> vertex_tet;
  std::vector<std::array<uint32_t, 2>> triangle_cells;
};

// The faces between the object's cells and all other cells. For every Delaunay edge (i, j) with i
// in the object and j not, the circumcentres of the tetrahedra around the edge, in cyclic order,
// are the corners of one flat convex polygon; it is cut into triangles from its lowest-numbered
// corner.
//
// The result is a closed, oriented 2-manifold, whatever the labels and however degenerate the
// sites:
// - A vertex is a tetrahedron, never a position. In a tetrahedron with corners inside and outside,
//   the edges between them, and with them the polygons, form one single cycle (of 3 or 4), so one
//   fan of faces meets there.
// - A polygon's side is a facet with corners inside and outside; it has exactly two such edges, so
//   exactly two polygons meet there, in opposite directions.
// - A polygon's diagonal joins two tetrahedra that share an edge but no facet; no other polygon
// holds
//   both, so it is no edge of the surface a second time.
// No hull facet is involved, because no real site lies on the hull. Corners of cospherical sites
// coincide: such surfaces have triangles without area, but no holes.
// Two neighbouring objects share the very same triangles, with opposite orientation.
ObjectSurface ExtractSurface(const ExportableScene& scene, const ObjectInfo& object);

// Gives every face of the surface the mean colour and confidence of its corners.
void ShowVerticesOnFaces(ObjectSurface* surface);

// Vertices of a `cells` surface that stick out: farther than eight times the median from the sites
// whose cells meet there. They belong to cells that border on wide empty space. Reported, never
// moved, so that the surface stays what it is.
int64_t CountFarVertices(const ExportableScene& scene, const ObjectSurface& surface);

struct SurfaceExportOptions {
  // "cells": the faces between the object's cells and all others, exact (ExtractSurface).
  // "smooth": an iso-surface on the Delaunay tetrahedra, smoothed (ExtractSmoothSurface).
  std::string method = "cells";
  // `smooth` only: at most so many triangles for each object (Decimate); 0 = all there are.
  int64_t target_faces = 0;

  LabelFilter objects;  // the others get no files, and are not in those of the scene

  bool om = true;   // OpenMesh: everything, lossless, in double
  bool ply = true;  // binary, positions in double, label and confidence on vertices and faces
  bool obj =
      true;  // text, vertex colours, a material in a .mtl; no labels beyond the object's name
  bool glb = true;   // binary glTF, per object and of the scene: see glb_file.h
  bool usda = true;  // text USD, of the scene: see usd_file.h

  // The "creator" that glTF and USD name: program and version.
  std::string creator = "Semantic Foam";
  // As VolumeExportOptions::source_checksum: the stage names no volume of another model. Empty =
  // not known.
  std::string source_checksum;

  // Returns an empty string, or one sentence that names the option out of range.
  std::string Check() const;
};

// Writes `objects/<file stem>.{om,ply,obj,mtl,glb}` for every object that the options have, and
// `scene.{glb,usda}` of them where there is one, into `output_path`. The stage names those objects'
// volumes that lie in `output_path` already. Calls `on_written` (if any) after each. What the files
// hold is said in the summaries: counts, shells, cavities and genus (surface_topology.h); for
// `smooth` also how far the surface is from the `cells` one and how many triangles intersect (after
// a decimation), and in a warning where it has more triangles than asked for. CHECKs that the
// options are in range; throws UserError when a file cannot be written.
std::vector<WrittenFile> ExportSurfaces(
    const ExportableScene& scene,
    const std::filesystem::path& output_path,
    const SurfaceExportOptions& options = {},
    const std::function<void(const WrittenFile&)>& on_written = nullptr);

}  // namespace semfoam
