// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface_export.h"

#include "export/glb_file.h"
#include "export/local_mesh.h"
#include "export/mesh_files.h"
#include "export/object_selection.h"
#include "export/semantic_mesh.h"
#include "export/smooth_surface.h"
#include "export/surface_decimation.h"
#include "export/surface_geometry.h"
#include "export/surface_topology.h"
#include "export/usd_file.h"
#include "export/volume_fields.h"
#include "foam/error.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Which corner of the tetrahedron comes next when turning counter-clockwise around its edge i -> j,
// seen from j: of the other two corners k and l, the tetrahedron (i, j, k, l) is positively
// oriented for exactly one order, and then the turn goes from k to l. Corners are given by their
// place in the tetrahedron, of which l is returned through `ahead` and k through `behind`.
void CornersAroundEdge(
    const std::array<uint32_t, 4>& tet, uint32_t i, uint32_t j, int* behind, int* ahead) {
  int places[4];
  int others = 2;
  for (int v = 0; v < 4; ++v) {
    if (tet[v] == i) {
      places[0] = v;
    } else if (tet[v] == j) {
      places[1] = v;
    } else {
      CHECK_LT(others, 4);
      places[others++] = v;
    }
  }
  CHECK_EQ(others, 4);
  int inversions = 0;
  for (int a = 0; a < 4; ++a) {
    for (int b = a + 1; b < 4; ++b) inversions += places[a] > places[b];
  }
  const bool even = inversions % 2 == 0;
  *behind = even ? places[2] : places[3];
  *ahead = even ? places[3] : places[2];
}

// The tetrahedra around the edge i -> j, counter-clockwise seen from j, the lowest number first.
void RingAroundEdge(
    const Delaunay& delaunay, uint32_t i, uint32_t j, uint32_t first, std::vector<uint32_t>* ring) {
  ring->clear();
  uint32_t tet = first;
  do {
    ring->push_back(tet);
    int behind, ahead;
    CornersAroundEdge(delaunay.tets[tet], i, j, &behind, &ahead);
    tet = delaunay.tet_neighbors[tet][behind];
    CHECK_NE(tet, kNoTet) << "a real site lies on the hull";
    CHECK_LE(ring->size(), delaunay.tets.size());
  } while (tet != first);
  std::rotate(ring->begin(), std::min_element(ring->begin(), ring->end()), ring->end());
}

bool Contains(const std::array<uint32_t, 4>& tet, uint32_t cell) {
  return std::find(tet.begin(), tet.end(), cell) != tet.end();
}

// How far the surface is from the cells' one: in the files' unit and of the length of its diagonal.
std::string DistanceSummary(const ObjectSurface& surface, const ObjectSurface& cells) {
  const SurfaceDistance there =
      DistanceTo(surface.vertices, surface.triangles, cells.vertices, cells.triangles);
  const SurfaceDistance back =
      DistanceTo(cells.vertices, cells.triangles, surface.vertices, surface.triangles);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : surface.vertices) box.extend(vertex);
  const double percent = 100 / box.diagonal().norm();
  const double hausdorff = std::max(there.max, back.max);
  char text[200];
  std::snprintf(text,
                sizeof(text),
                ", from the cells %.3g in the mean (%.2g %% of the diagonal) and %.3g at most "
                "(%.2g %%), Hausdorff distance %.3g (%.2g %%)",
                there.mean,
                percent * there.mean,
                there.max,
                percent * there.max,
                hausdorff,
                percent * hausdorff);
  return text;
}

struct MadeSurface {
  ObjectSurface surface;
  std::string summary;
  std::string warning;
};

MadeSurface MakeSurface(const ExportableScene& scene,
                        const ObjectInfo& object,
                        const SurfaceExportOptions& options) {
  MadeSurface made;
  made.surface = ExtractSurface(scene, object);
  std::string faces, more;
  if (options.method == "smooth") {
    const ObjectSurface cells = std::move(made.surface);
    made.surface = ExtractSmoothSurface(scene, object, cells);
    if (const int64_t target = options.target_faces; target > 0) {
      made.surface = Decimate(made.surface, target);
      const Triangles& triangles = made.surface.triangles;
      if (const size_t crossing = SelfIntersections(made.surface.vertices, triangles).size();
          crossing > 0) {
        faces = ", " + std::to_string(crossing) + " of which intersect";
      }
      if (static_cast<int64_t>(triangles.size()) > target) {
        made.warning = std::to_string(triangles.size()) + " faces instead of " +
                       std::to_string(target) +
                       ", because fewer would tear the surface or fold it.";
      }
    }
    more = DistanceSummary(made.surface, cells);
  } else if (const int64_t far = CountFarVertices(scene, made.surface); far > 0) {
    more = ", " + std::to_string(far) + " vertices stick out into empty space";
  }
  const SurfaceTopology topology = TopologyOf(made.surface.vertices.size(), made.surface.triangles);
  made.summary = std::to_string(made.surface.vertices.size()) + " vertices, " +
                 std::to_string(made.surface.triangles.size()) + " faces" + faces + ", " +
                 TopologySummary(topology, object.pieces) + more;
  return made;
}

}  // namespace

Color8 ToColor8(const Eigen::Vector3f& display) {
  Color8 color;
  for (int c = 0; c < 3; ++c) {
    color[c] = static_cast<uint8_t>(std::lround(255 * std::clamp(display[c], 0.f, 1.f)));
  }
  return color;
}

void ShowVerticesOnFaces(ObjectSurface* surface) {
  surface->face_color.clear();
  surface->face_confidence.clear();
  for (const auto& [a, b, c] : surface->triangles) {
    Color8& color = surface->face_color.emplace_back();
    for (int k = 0; k < 3; ++k) {
      const int sum =
          surface->vertex_color[a][k] + surface->vertex_color[b][k] + surface->vertex_color[c][k];
      color[k] = static_cast<uint8_t>((sum + 1) / 3);
    }
    surface->face_confidence.push_back((surface->vertex_confidence[a] +
                                        surface->vertex_confidence[b] +
                                        surface->vertex_confidence[c]) /
                                       3);
  }
}

ObjectSurface ExtractSurface(const ExportableScene& scene, const ObjectInfo& object) {
  const Delaunay& delaunay = scene.delaunay;
  std::vector<uint8_t> inside(delaunay.num_cells, 0);
  for (const uint32_t cell : object.cells) inside[cell] = 1;

  ObjectSurface surface;
  surface.object_id = object.id;
  surface.object_name = object.name;
  // Tetrahedra with a corner outside are the vertices, numbered as the tetrahedra are.
  for (const uint32_t cell : object.cells) {
    for (const uint32_t tet : scene.tets_of_cells.Of(cell)) {
      const auto& corners = delaunay.tets[tet];
      if (std::any_of(corners.begin(), corners.end(), [&](uint32_t c) { return !inside[c]; })) {
        surface.vertex_tet.push_back(tet);
      }
    }
  }
  auto& tets = surface.vertex_tet;
  std::sort(tets.begin(), tets.end());
  tets.erase(std::unique(tets.begin(), tets.end()), tets.end());
  const auto vertex_of = [&](uint32_t tet) {
    return static_cast<uint32_t>(std::lower_bound(tets.begin(), tets.end(), tet) - tets.begin());
  };

  for (const uint32_t tet : tets) {
    surface.vertices.push_back(scene.FileFromNormalized(scene.voronoi_vertices[tet]));
    Eigen::Vector3f color = Eigen::Vector3f::Zero();
    float confidence = 0, weight = 0;
    int count = 0;
    for (const uint32_t cell : delaunay.tets[tet]) {
      if (!inside[cell]) continue;
      color += scene.color_weight[cell] * scene.display_color[cell];
      weight += scene.color_weight[cell];
      confidence += scene.labels.confidence[cell];
      ++count;
    }
    surface.vertex_color.push_back(ToColor8(color / weight));
    surface.vertex_confidence.push_back(confidence / static_cast<float>(count));
  }

  std::vector<uint32_t> ring;
  for (const uint32_t i : object.cells) {
    const Color8 color = ToColor8(scene.display_color[i]);
    for (const uint32_t j : delaunay.Neighbors(i)) {
      if (inside[j]) continue;
      const auto around = scene.tets_of_cells.Of(i);
      const auto first = std::find_if(around.begin(), around.end(), [&](uint32_t tet) {
        return Contains(delaunay.tets[tet], j);
      });
      CHECK(first != around.end());
      RingAroundEdge(delaunay, i, j, *first, &ring);
      const uint32_t apex = vertex_of(ring[0]);
      uint32_t last = vertex_of(ring[1]);
      for (size_t k = 2; k < ring.size(); ++k) {
        const uint32_t next = vertex_of(ring[k]);
        surface.triangles.push_back({apex, last, next});
        surface.triangle_cells.push_back({i, j});
        surface.face_color.push_back(color);
        surface.face_confidence.push_back(scene.labels.confidence[i]);
        last = next;
      }
    }
  }
  return surface;
}

int64_t CountFarVertices(const ExportableScene& scene, const ObjectSurface& surface) {
  std::vector<double> distances;
  for (const uint32_t tet : surface.vertex_tet) {
    const uint32_t cell = scene.delaunay.tets[tet][0];
    distances.push_back(
        (scene.voronoi_vertices[tet] - scene.cell_positions[cell].cast<double>()).norm());
  }
  if (distances.empty()) return 0;
  std::vector<double> sorted = distances;
  const auto middle = sorted.begin() + sorted.size() / 2;
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double limit = 8 * *middle;
  return std::count_if(
      distances.begin(), distances.end(), [&](double distance) { return distance > limit; });
}

std::string SurfaceExportOptions::Check() const {
  if (method != "cells" && method != "smooth") return "method must be cells or smooth.";
  if (target_faces != 0 && target_faces < 4) {
    return "target_faces must be at least 4, the faces of a tetrahedron, or 0 for all there are.";
  }
  if (target_faces != 0 && method != "smooth") {
    return "target_faces needs the method smooth; cells are exact and keep all their faces.";
  }
  return "";
}

std::vector<WrittenFile> ExportSurfaces(const ExportableScene& scene,
                                        const std::filesystem::path& output_path,
                                        const SurfaceExportOptions& options,
                                        const std::function<void(const WrittenFile&)>& on_written) {
  CHECK_EQ(options.Check(), "");
  std::vector<WrittenFile> files;
  const std::vector<const ObjectInfo*> objects = SelectObjects(scene, options.objects);
  if (objects.empty()) return files;
  const auto written = [&](int32_t id,
                           const std::string& path,
                           const std::string& summary,
                           const std::string& warning = {}) {
    files.push_back({id, path.substr(path.rfind('.') + 1), path, summary, warning});
    if (on_written) on_written(files.back());
  };
  GlbFile scene_glb(scene.transform, options.creator);
  std::optional<UsdFile> scene_usda;
  std::string usda_warning;
  if (options.usda)
    scene_usda.emplace(output_path / "scene.usda", scene.transform, options.creator);

  for (const ObjectInfo* const one : objects) {
    const ObjectInfo& object = *one;
    const MadeSurface made = MakeSurface(scene, object, options);
    const ObjectSurface& surface = made.surface;
    const std::string stem = "objects/" + object.file_stem;
    const auto write = [&](bool wanted, const char* extension, const auto& writer) {
      if (!wanted) return;
      writer(output_path / (stem + extension), surface);
      written(object.id, stem + extension, made.summary, made.warning);
    };
    write(options.om, ".om", WriteOm);
    write(options.ply, ".ply", WritePly);
    write(options.obj, ".obj", WriteObj);
    write(options.obj, ".mtl", WriteMtl);
    if (!options.glb && !options.usda) continue;

    const LocalMesh mesh = MakeLocalMesh(surface);
    write(options.glb, ".glb", [&](const std::filesystem::path& path, const auto&) {
      GlbFile glb(scene.transform, options.creator);
      glb.Add(object, surface, mesh);
      glb.Write(path);
    });
    if (options.glb) scene_glb.Add(object, surface, mesh);
    if (scene_usda) {
      std::vector<VolumeField> volume_fields;
      try {
        volume_fields = ReadVolumeFields(output_path / (stem + ".vdb"), options.source_checksum);
      } catch (const UserError& error) {
        // The surfaces are no worse for it.
        usda_warning += (usda_warning.empty() ? "does without " : " ") + std::string(error.what());
      }
      scene_usda->Add(object, surface, mesh, stem + ".vdb", volume_fields);
    }
  }
  const std::string summary =
      std::to_string(objects.size()) + (objects.size() == 1 ? " object" : " objects");
  if (options.glb) {
    scene_glb.Write(output_path / "scene.glb");
    written(0, "scene.glb", summary);
  }
  if (scene_usda) {
    scene_usda->Finish();
    written(0, "scene.usda", summary, usda_warning);
  }
  return files;
}

}  // namespace semfoam
