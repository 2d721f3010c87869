// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/transfer/boundary_caps.h"
#include "export/transfer/polygon_mesh.h"
#include "foam/model/model.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The objects that a labelled mesh or cloud is split into.
struct MeshParts {
  // Ascending, without kNoObject.
  std::vector<LabelId> ids;
  // [faces or points] The index of its label in `ids`; ids.size() without a label.
  std::vector<uint32_t> part_of;

  uint32_t size() const { return static_cast<uint32_t>(ids.size()); }
};

MeshParts FindMeshParts(const std::vector<LabelId>& labels);
MeshParts FindMeshParts(const std::vector<SurfaceLabel>& labels);

// Returns the file of each part, objects/<id>_<name>.<format>, without a summary. `labels` is the
// table of names.
std::vector<WrittenFile> PartFiles(const MeshParts& parts,
                                   const std::vector<Label>& labels,
                                   const std::string& format);

// Returns the name of a label in the table, empty where it has none.
std::string NameIn(const std::vector<Label>& labels, LabelId id);

// Returns "12 vertices, 20 faces, 1 cap", without what there is none of.
std::string PartSummary(uint64_t vertices, uint64_t faces, uint64_t caps);

// A part of a mesh: its faces in their order and, behind them, the triangles that close it.
struct MeshPart {
  std::vector<uint32_t> faces;
  // The vertices of the faces, ascending, and behind them the centres of caps.
  std::vector<uint32_t> vertices;
  std::vector<Eigen::Vector3d> centers;
  // [centers] The index in `vertices` of one on the loop about it.
  std::vector<uint32_t> beside_center;
  uint64_t num_caps = 0;
  // Corners count in `vertices` and, from vertices.size() on, in `centers`.
  std::vector<std::array<uint32_t, 3>> cap_triangles;

  uint64_t NumVertices() const { return vertices.size() + centers.size(); }
  uint64_t NumFaces() const { return faces.size() + cap_triangles.size(); }
  // The index in `vertices` of a vertex of the mesh, which must be there.
  uint32_t IndexOf(uint32_t vertex) const;
  // The place of a vertex of the part.
  const Eigen::Vector3d& Place(const PolygonMesh& mesh, uint32_t vertex) const;
};

// Takes a mesh apart; with `cap`, closes the boundary loops of the parts (FindBoundaryCaps).
std::vector<MeshPart> TakeApart(const PolygonMesh& mesh, const MeshParts& parts, bool cap);

}  // namespace semfoam
