// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/object_surface.h"

#include "export/scene/object_faces.h"
#include "foam/util/median.h"

#include <algorithm>
#include <cmath>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Which corner of the tetrahedron comes next when turning counter-clockwise around its edge i -> j,
// seen from j: of the other two corners k and l, the tetrahedron (i, j, k, l) is positively
// oriented for exactly one order, and then the turn goes from k to l. Corners are given by their
// place in the tetrahedron, of which l is returned through `ahead` and k through `behind`.
void CornersAroundEdge(
    const std::array<uint32_t, 4>& tet, uint32_t i, uint32_t j, int* behind, int* ahead) {
  const auto place_of = [&](uint32_t cell) {
    const auto place = std::find(tet.begin(), tet.end(), cell);
    CHECK(place != tet.end());
    return static_cast<int>(place - tet.begin());
  };
  const int at_i = place_of(i), at_j = place_of(j);
  int k = 0, l = 3;
  while (k == at_i || k == at_j) ++k;
  while (l == at_i || l == at_j) --l;
  const std::array<int, 4> places = {at_i, at_j, k, l};
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

// The tetrahedra with corners inside and outside of the object, ascending: they are the vertices.
std::vector<uint32_t> BoundaryTets(const ExportableScene& scene,
                                   const ObjectInfo& object,
                                   const std::vector<uint8_t>& inside) {
  std::vector<uint32_t> tets;
  for (const uint32_t cell : object.cells) {
    for (const uint32_t tet : scene.tets_of_cells.Of(cell)) {
      const auto& corners = scene.delaunay.tets[tet];
      if (std::any_of(corners.begin(), corners.end(), [&](uint32_t c) { return !inside[c]; })) {
        tets.push_back(tet);
      }
    }
  }
  std::sort(tets.begin(), tets.end());
  tets.erase(std::unique(tets.begin(), tets.end()), tets.end());
  return tets;
}

// Adds the circumcentres of surface->vertex_tet, with the mean colour and confidence of the cells
// inside that meet there.
void AddVertices(const ExportableScene& scene,
                 const std::vector<uint8_t>& inside,
                 ObjectSurface* surface) {
  for (const uint32_t tet : surface->vertex_tet) {
    surface->vertices.push_back(scene.FileFromNormalized(scene.voronoi_vertices[tet]));
    Eigen::Vector3f color = Eigen::Vector3f::Zero();
    float confidence = 0, weight = 0;
    int count = 0;
    for (const uint32_t cell : scene.delaunay.tets[tet]) {
      if (!inside[cell]) continue;
      color += scene.color_weight[cell] * scene.display_color[cell];
      weight += scene.color_weight[cell];
      confidence += scene.labels.confidence[cell];
      ++count;
    }
    surface->vertex_color.push_back(ToColor8(color / weight));
    surface->vertex_confidence.push_back(confidence / static_cast<float>(count));
  }
}

// Adds the polygons between the object's cells and all others, cut into triangles.
void AddFaces(const ExportableScene& scene,
              const ObjectInfo& object,
              const std::vector<uint8_t>& inside,
              ObjectSurface* surface) {
  const Delaunay& delaunay = scene.delaunay;
  const std::vector<uint32_t>& tets = surface->vertex_tet;
  const auto vertex_of = [&](uint32_t tet) {
    return static_cast<uint32_t>(std::lower_bound(tets.begin(), tets.end(), tet) - tets.begin());
  };
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
        surface->triangles.push_back({apex, last, next});
        surface->triangle_cells.push_back({i, j});
        surface->face_color.push_back(color);
        surface->face_confidence.push_back(scene.labels.confidence[i]);
        last = next;
      }
    }
  }
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
  std::vector<uint8_t> inside(scene.delaunay.num_cells, 0);
  for (const uint32_t cell : object.cells) inside[cell] = 1;
  return ExtractFaces(scene, object, inside);
}

ObjectSurface ExtractFaces(const ExportableScene& scene,
                           const ObjectInfo& object,
                           const std::vector<uint8_t>& inside) {
  ObjectSurface surface;
  surface.object_id = object.id;
  surface.object_name = object.name;
  surface.vertex_tet = BoundaryTets(scene, object, inside);
  AddVertices(scene, inside, &surface);
  AddFaces(scene, object, inside, &surface);
  return surface;
}

int64_t CountFarVertices(const ExportableScene& scene, const ObjectSurface& surface) {
  std::vector<double> distances;
  for (const uint32_t tet : surface.vertex_tet) {
    const uint32_t cell = scene.delaunay.tets[tet][0];
    distances.push_back(
        (scene.voronoi_vertices[tet] - scene.cell_positions[cell].cast<double>()).norm());
  }
  return CountFarDistances(distances);
}

int64_t CountFarDistances(const std::vector<double>& distances) {
  if (distances.empty()) return 0;
  const double limit = 8 * Median(distances);
  return std::count_if(
      distances.begin(), distances.end(), [&](double distance) { return distance > limit; });
}

}  // namespace semfoam
