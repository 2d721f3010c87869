// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/report/overlay_pack.h"

#include "export/scene/object_surface.h"
#include "export/surface/smooth_surface.h"
#include "export/surface/surface_decimation.h"
#include "foam/geometry/guard_sites.h"
#include "foam/util/parallel.h"
#include "plugin/colmap/colmap_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using nlohmann::ordered_json;

ordered_json ToJson(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

template <typename T>
void Append(const T* values, size_t count, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

// Appends positions and colours, and returns what the header says of them.
ordered_json AppendVertices(const std::vector<Eigen::Vector3d>& positions,
                            const std::vector<Color8>& colors,
                            std::string* bytes) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& position : positions) box.extend(position);
  if (positions.empty()) box.extend(Eigen::Vector3d::Zero());
  const Eigen::Vector3d step = (box.sizes() / 65535).cwiseMax(1e-12);
  ordered_json header = {
      {"begin", bytes->size()}, {"origin", ToJson(box.min())}, {"step", ToJson(step)}};
  for (const Eigen::Vector3d& position : positions) {
    uint16_t integers[3];
    for (int k = 0; k < 3; ++k) {
      integers[k] = static_cast<uint16_t>(std::lround((position[k] - box.min()[k]) / step[k]));
    }
    Append(integers, 3, bytes);
  }
  for (const Color8& color : colors) Append(color.data(), 3, bytes);
  bytes->resize((bytes->size() + 3) / 4 * 4, '\0');
  return header;
}

Eigen::Vector3d NormalizedFromFile(const ExportableScene& scene, const Eigen::Vector3d& x) {
  return scene.world_from_normalized.Invert(scene.transform.rotation.transpose() * x);
}

void AppendSurfaces(const ExportableScene& scene, int64_t max_faces, PackedOverlays* packed) {
  packed->header["surfaces"] = ordered_json::array();
  std::vector<ObjectSurface> surfaces(scene.objects.size());
  ParallelForBlocks(std::ssize(surfaces), 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const ObjectInfo& object = scene.objects[i];
      surfaces[i] = ExtractSmoothSurface(scene, object, ExtractSurface(scene, object));
    }
  });
  int64_t faces = 0;
  for (const ObjectSurface& surface : surfaces) faces += std::ssize(surface.triangles);
  for (size_t i = 0; i < surfaces.size(); ++i) {
    ObjectSurface& surface = surfaces[i];
    const int64_t share = max_faces * std::ssize(surface.triangles) / std::max<int64_t>(1, faces);
    if (faces > max_faces && share > 0) surface = Decimate(surface, share);
    for (Eigen::Vector3d& vertex : surface.vertices) vertex = NormalizedFromFile(scene, vertex);
    ordered_json header = AppendVertices(surface.vertices, surface.vertex_color, &packed->bytes);
    header["object"] = i;
    header["vertices"] = surface.vertices.size();
    header["triangles"] = surface.triangles.size();
    for (const std::array<uint32_t, 3>& triangle : surface.triangles) {
      Append(triangle.data(), 3, &packed->bytes);
    }
    packed->header["surfaces"].push_back(std::move(header));
  }
}

void AppendPoints(const Model& model,
                  const std::filesystem::path& input_path,
                  int64_t max_points,
                  PackedOverlays* packed) {
  packed->header["points"] = nullptr;
  if (input_path.empty() || max_points <= 0) return;
  const Reconstruction reconstruction = ReadReconstruction(FindModelFolder(input_path));
  std::vector<const Point3D*> good;
  for (const Point3D& point : reconstruction.points) {
    if (point.track.size() >= 3 && point.position.allFinite()) good.push_back(&point);
  }
  const int64_t total = std::ssize(good), count = std::min(total, max_points);
  std::vector<Eigen::Vector3d> positions;
  std::vector<Color8> colors;
  for (int64_t i = 0; i < count; ++i) {
    const Point3D& point = *good[i * total / count];
    const Eigen::Vector3d x = model.world_from_normalized.Invert(point.position);
    // Far outliers would take all of the 16 bits.
    if (x.norm() > kFarRadius) continue;
    positions.push_back(x);
    colors.push_back({point.color[0], point.color[1], point.color[2]});
  }
  packed->header["points"] = AppendVertices(positions, colors, &packed->bytes);
  packed->header["points"]["points"] = positions.size();
}

}  // namespace

PackedOverlays PackOverlays(const Model& model,
                            const ExportableScene& scene,
                            const std::filesystem::path& input_path,
                            int64_t max_faces,
                            int64_t max_points) {
  PackedOverlays packed;
  AppendSurfaces(scene, max_faces, &packed);
  AppendPoints(model, input_path, max_points, &packed);
  packed.header["bytes"] = packed.bytes.size();
  return packed;
}

}  // namespace semfoam
