// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/blocks/block_surfaces.h"

#include "export/blocks/piece_file.h"
#include "export/scene/object_description.h"
#include "export/scene/object_faces.h"
#include "export/scene/surface_topology.h"

#include <algorithm>
#include <array>
#include <string>
#include <unordered_map>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// The numbers of the sites of a vertex in the whole foam, ascending.
using VertexKey = std::array<uint32_t, 4>;

// Of vertices that are in no other block's piece.
constexpr VertexKey kInOneBlock = {kNoCell, kNoCell, kNoCell, kNoCell};

struct HashKey {
  size_t operator()(const VertexKey& key) const {
    uint64_t hash = 0;
    for (const uint32_t id : key) hash = (hash ^ id) * 0x9e3779b97f4a7c15u;
    return hash;
  }
};

fs::path PiecePath(const fs::path& folder, LabelId object, size_t block) {
  return folder / ("surface_" + std::to_string(Value(object)) + "_" + std::to_string(block));
}

// Keys of a piece's vertices: other blocks have those that cells of theirs inside of the object
// touch.
std::vector<VertexKey> KeysOf(const BlockScene& block,
                              const std::vector<uint8_t>& inside,
                              const ObjectSurface& surface) {
  std::vector<VertexKey> keys;
  keys.reserve(surface.vertex_tet.size());
  for (const uint32_t tet : surface.vertex_tet) {
    VertexKey& key = keys.emplace_back(kInOneBlock);
    const std::array<uint32_t, 4>& corners = block.scene.delaunay.tets[tet];
    if (std::none_of(corners.begin(), corners.end(), [&](uint32_t cell) {
          return cell >= block.num_own && inside[cell];
        })) {
      continue;
    }
    for (int k = 0; k < 4; ++k) key[k] = block.ids[corners[k]];
    std::sort(key.begin(), key.end());
  }
  return keys;
}

}  // namespace

void TakeObjects(const ExportableScene& objects, BlockScene* block) {
  ExportableScene& scene = block->scene;
  scene.objects.clear();
  for (const ObjectInfo& object : objects.objects) {
    ObjectInfo& own = scene.objects.emplace_back();
    own.id = object.id;
    own.name = object.name;
    own.file_stem = object.file_stem;
    own.color = object.color;
  }
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    const int32_t object = objects.object_of_cell[block->ids[i]];
    scene.object_of_cell[i] = object;
    if (object >= 0 && i < block->num_own) scene.objects[object].cells.push_back(i);
  }
}

void WriteSurfacePieces(const BlockScene& block, size_t number, const fs::path& folder) {
  const ExportableScene& scene = block.scene;
  std::vector<uint8_t> inside(scene.delaunay.num_cells);
  for (size_t index = 0; index < scene.objects.size(); ++index) {
    const ObjectInfo& object = scene.objects[index];
    if (object.cells.empty()) continue;
    std::fill(inside.begin(), inside.end(), 0);
    for (uint32_t i = 0; i < scene.NumSites(); ++i) {
      inside[i] = scene.object_of_cell[i] == static_cast<int32_t>(index);
    }
    const ObjectSurface surface = ExtractFaces(scene, object, inside);
    if (surface.triangles.empty()) continue;
    std::vector<Eigen::Vector3d> vertices;
    std::vector<double> distances;
    for (const uint32_t tet : surface.vertex_tet) {
      vertices.push_back(scene.voronoi_vertices[tet]);
      const Eigen::Vector3f& site = scene.cell_positions[scene.delaunay.tets[tet][0]];
      distances.push_back((vertices.back() - site.cast<double>()).norm());
    }
    PieceWriter file(PiecePath(folder, object.id, number));
    file.Write(KeysOf(block, inside, surface));
    file.Write(vertices);
    file.Write(distances);
    file.Write(surface.vertex_color);
    file.Write(surface.vertex_confidence);
    file.Write(surface.triangles);
    file.Write(surface.face_color);
    file.Write(surface.face_confidence);
    file.Close();
  }
}

JoinedSurface JoinSurface(const ExportableScene& objects,
                          size_t object,
                          size_t num_blocks,
                          const fs::path& folder) {
  const ObjectInfo& info = objects.objects[object];
  JoinedSurface joined;
  ObjectSurface& surface = joined.surface;
  surface.object_id = info.id;
  surface.object_name = info.name;
  std::unordered_map<VertexKey, uint32_t, HashKey> on_seams;
  std::vector<uint32_t> place;
  for (size_t b = 0; b < num_blocks; ++b) {
    const fs::path path = PiecePath(folder, info.id, b);
    if (!fs::exists(path)) continue;
    PieceReader file(path);
    const auto keys = file.Read<VertexKey>();
    const auto vertices = file.Read<Eigen::Vector3d>();
    const auto distances = file.Read<double>();
    const auto colors = file.Read<Color8>();
    const auto confidences = file.Read<float>();
    place.clear();
    for (size_t v = 0; v < vertices.size(); ++v) {
      const auto next = static_cast<uint32_t>(surface.vertices.size());
      if (keys[v] != kInOneBlock) {
        const auto [entry, is_new] = on_seams.emplace(keys[v], next);
        place.push_back(entry->second);
        if (!is_new) continue;
      } else {
        place.push_back(next);
      }
      surface.vertices.push_back(objects.FileFromNormalized(vertices[v]));
      surface.vertex_color.push_back(colors[v]);
      surface.vertex_confidence.push_back(confidences[v]);
      joined.normalized.push_back(vertices[v]);
      joined.distances.push_back(distances[v]);
    }
    for (const auto& [i, j, k] : file.Read<std::array<uint32_t, 3>>()) {
      surface.triangles.push_back({place[i], place[j], place[k]});
    }
    const auto face_color = file.Read<Color8>();
    const auto face_confidence = file.Read<float>();
    surface.face_color.insert(surface.face_color.end(), face_color.begin(), face_color.end());
    surface.face_confidence.insert(
        surface.face_confidence.end(), face_confidence.begin(), face_confidence.end());
  }
  return joined;
}

void DescribeBySurface(const ObjectSurface& surface, ObjectInfo* object) {
  const SurfaceTopology topology = TopologyOf(surface.vertices.size(), surface.triangles);
  object->cavities = NumCavities(topology, object->components);
  object->genus = topology.genus;
  const SurfaceIntegrals integrals = IntegrateSurface(surface.vertices, surface.triangles);
  object->area = integrals.area;
  object->centroid = integrals.centroid;
}

}  // namespace semfoam
