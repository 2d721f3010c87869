// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/mesh_parts.h"

#include "export/scene/names.h"

#include <algorithm>

#include <glog/logging.h>

namespace semfoam {

MeshParts FindMeshParts(const std::vector<LabelId>& labels) {
  MeshParts parts;
  for (const LabelId id : labels) {
    const auto at = std::lower_bound(parts.ids.begin(), parts.ids.end(), id);
    if (id != kNoObject && (at == parts.ids.end() || *at != id)) parts.ids.insert(at, id);
  }
  parts.part_of.reserve(labels.size());
  for (const LabelId id : labels) {
    const auto at = std::lower_bound(parts.ids.begin(), parts.ids.end(), id);
    parts.part_of.push_back(id == kNoObject ? parts.size()
                                            : static_cast<uint32_t>(at - parts.ids.begin()));
  }
  return parts;
}

MeshParts FindMeshParts(const std::vector<SurfaceLabel>& labels) {
  std::vector<LabelId> ids;
  ids.reserve(labels.size());
  for (const SurfaceLabel& label : labels) ids.push_back(label.id);
  return FindMeshParts(ids);
}

std::vector<WrittenFile> PartFiles(const MeshParts& parts,
                                   const std::vector<Label>& labels,
                                   const std::string& format) {
  std::vector<WrittenFile> files;
  for (const LabelId id : parts.ids) {
    files.push_back({id, format, "objects/" + FileStem(id, NameIn(labels, id)) + "." + format, ""});
  }
  return files;
}

std::string NameIn(const std::vector<Label>& labels, LabelId id) {
  const auto label = std::find_if(
      labels.begin(), labels.end(), [&](const Label& other) { return other.id == id; });
  return label == labels.end() ? "" : label->name;
}

std::string PartSummary(uint64_t vertices, uint64_t faces, uint64_t caps) {
  std::string summary = std::to_string(vertices);
  if (faces == 0) return summary + " points";
  summary += " vertices, " + std::to_string(faces) + " faces";
  if (caps > 0) summary += ", " + std::to_string(caps) + (caps == 1 ? " cap" : " caps");
  return summary;
}

uint32_t MeshPart::IndexOf(uint32_t vertex) const {
  const auto at = std::lower_bound(vertices.begin(), vertices.end(), vertex);
  CHECK(at != vertices.end() && *at == vertex);
  return static_cast<uint32_t>(at - vertices.begin());
}

const Eigen::Vector3d& MeshPart::Place(const PolygonMesh& mesh, uint32_t vertex) const {
  return vertex < vertices.size() ? mesh.vertices[vertices[vertex]]
                                  : centers[vertex - vertices.size()];
}

std::vector<MeshPart> TakeApart(const PolygonMesh& mesh, const MeshParts& parts, bool cap) {
  std::vector<MeshPart> result(parts.size());
  for (uint32_t f = 0; f < mesh.NumFaces(); ++f) {
    if (parts.part_of[f] == parts.size()) continue;
    MeshPart& part = result[parts.part_of[f]];
    part.faces.push_back(f);
    part.vertices.insert(part.vertices.end(), mesh.Face(f).begin(), mesh.Face(f).end());
  }
  for (MeshPart& part : result) {
    std::sort(part.vertices.begin(), part.vertices.end());
    part.vertices.erase(std::unique(part.vertices.begin(), part.vertices.end()),
                        part.vertices.end());
  }
  if (!cap) return result;
  for (const BoundaryCap& one : FindBoundaryCaps(mesh, parts.part_of, parts.size())) {
    MeshPart& part = result[one.part];
    const auto center = static_cast<uint32_t>(part.NumVertices());
    if (one.HasCenter()) {
      part.centers.push_back(one.Center(mesh));
      part.beside_center.push_back(part.IndexOf(one.loop[0]));
    }
    for (size_t k = 0; k < one.NumTriangles(); ++k) {
      part.cap_triangles.push_back({part.IndexOf(one.loop[k]),
                                    part.IndexOf(one.loop[(k + 1) % one.loop.size()]),
                                    one.HasCenter() ? center : part.IndexOf(one.loop[2])});
    }
    ++part.num_caps;
  }
  return result;
}

}  // namespace semfoam
