// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/smooth_surface.h"

#include "export/surface/surface_geometry.h"
#include "export/surface/surface_smoothing.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;

// Number of radii from its sites beyond which a corner of a cell is a spike.
constexpr double kSpikeRadii = 3;
// How far a vertex may move, as a share of its cell's radius and of its half edge.
constexpr double kMaxMove = 0.9;

// From a site of the object to one that is not.
using CutEdge = std::pair<uint32_t, uint32_t>;

// Everything here is in the normalised frame, where rounding is the same wherever the scene lies.
class Builder {
 public:
  Builder(const ExportableScene& scene, const ObjectInfo& object)
      : scene_(scene), inside_(scene.delaunay.num_cells, 0) {
    for (const uint32_t cell : object.cells) inside_[cell] = 1;
    for (const uint32_t i : object.cells) {
      for (const uint32_t j : scene.delaunay.Neighbors(i)) {
        if (!inside_[j]) edges_.emplace_back(i, j);
      }
    }
    // Cells and neighbours ascend, so the edges do.
    CHECK(std::is_sorted(edges_.begin(), edges_.end()));
  }

  const std::vector<CutEdge>& edges() const { return edges_; }

  Vector3d Site(uint32_t cell) const { return scene_.cell_positions[cell].cast<double>(); }

  // The on_edges of the edges, or nearer to the object's site, where the other is so far off that
  // the middle would be a spike.
  std::vector<Vector3d> PointsOnEdges() const {
    std::vector<Vector3d> points;
    points.reserve(edges_.size());
    for (const auto& [i, j] : edges_) {
      const Vector3d half_edge = (Site(j) - Site(i)) / 2;
      points.push_back(Site(i) +
                       std::min(1.0, kSpikeRadii * Radius(i, j) / half_edge.norm()) * half_edge);
    }
    return points;
  }

  // `tets`: those with corners on both sides. A quadrangle is cut along the diagonal that is the
  // shorter one where the vertices are at `on_edges`.
  Triangles March(const std::vector<uint32_t>& tets, const std::vector<Vector3d>& on_edges) const {
    Triangles triangles;
    for (const uint32_t tet : tets) {
      const auto& corners = scene_.delaunay.tets[tet];
      // The inner corners first, in an order that is positively oriented as the tetrahedron is.
      std::array<int, 4> order;
      int num_inside = 0;
      for (int k = 0; k < 4; ++k) {
        if (inside_[corners[k]]) order[num_inside++] = k;
      }
      for (int k = 0, place = num_inside; k < 4; ++k) {
        if (!inside_[corners[k]]) order[place++] = k;
      }
      int inversions = 0;
      for (int a = 0; a < 4; ++a) {
        for (int b = a + 1; b < 4; ++b) inversions += order[a] > order[b];
      }
      if (inversions % 2 != 0) {
        if (num_inside == 3) {
          std::swap(order[0], order[1]);
        } else {
          std::swap(order[2], order[3]);
        }
      }
      const uint32_t a = corners[order[0]], b = corners[order[1]], c = corners[order[2]],
                     d = corners[order[3]];
      if (num_inside == 1) {
        triangles.push_back({VertexOf(a, b), VertexOf(a, c), VertexOf(a, d)});
      } else if (num_inside == 3) {
        triangles.push_back({VertexOf(a, d), VertexOf(b, d), VertexOf(c, d)});
      } else {
        const uint32_t ac = VertexOf(a, c), ad = VertexOf(a, d), bd = VertexOf(b, d),
                       bc = VertexOf(b, c);
        if ((on_edges[ac] - on_edges[bd]).norm() <= (on_edges[ad] - on_edges[bc]).norm()) {
          triangles.push_back({ac, ad, bd});
          triangles.push_back({ac, bd, bc});
        } else {
          triangles.push_back({ac, ad, bc});
          triangles.push_back({ad, bd, bc});
        }
      }
    }
    return triangles;
  }

  // Returns the corners of the faces between the cells, spikes cut off. As `tets`.
  std::vector<Vector3d> TrimmedCorners(const std::vector<uint32_t>& tets) const {
    std::vector<Vector3d> corners;
    corners.reserve(tets.size());
    for (const uint32_t tet : tets) {
      Vector3d site = Vector3d::Zero();
      double radius = 0;
      int count = 0;
      for (const uint32_t cell : scene_.delaunay.tets[tet]) {
        if (!inside_[cell]) continue;
        site += Site(cell);
        radius += scene_.radius[cell];
        ++count;
      }
      site /= count;
      const double limit = kSpikeRadii * radius / count;
      const Vector3d reach = scene_.voronoi_vertices[tet] - site;
      const double length = reach.norm();
      corners.push_back(length > limit ? Vector3d(site + limit / length * reach)
                                       : scene_.voronoi_vertices[tet]);
    }
    return corners;
  }

  // Returns the centroids of the Voronoi faces, `cells` with its corners at `corners`; the point on
  // the edge where a face has no area.
  std::vector<Vector3d> FaceCentroids(const ObjectSurface& cells,
                                      const std::vector<Vector3d>& corners,
                                      const std::vector<Vector3d>& on_edges) const {
    std::vector<Vector3d> moments(edges_.size(), Vector3d::Zero());
    std::vector<double> areas(edges_.size(), 0);
    for (size_t f = 0; f < cells.triangles.size(); ++f) {
      const auto& [i, j] = cells.triangle_cells[f];
      const uint32_t v = VertexOf(i, j);
      const auto& [a, b, c] = cells.triangles[f];
      const double area = (corners[b] - corners[a]).cross(corners[c] - corners[a]).norm();
      // From a point near by, so that a face of next to no area is not lost to rounding.
      moments[v] += area * ((corners[a] + corners[b] + corners[c]) / 3 - on_edges[v]);
      areas[v] += area;
    }
    std::vector<Vector3d> centroids = on_edges;
    for (size_t v = 0; v < edges_.size(); ++v) {
      if (areas[v] > 0) centroids[v] += moments[v] / areas[v];
    }
    return centroids;
  }

  std::vector<double> MaxMoves() const {
    std::vector<double> moves;
    moves.reserve(edges_.size());
    for (const auto& [i, j] : edges_) {
      moves.push_back(kMaxMove * std::min(Radius(i, j), (Site(j) - Site(i)).norm() / 2));
    }
    return moves;
  }

 private:
  // Of cell i, on its edge to j: a cell without real neighbours has none of its own.
  double Radius(uint32_t i, uint32_t j) const {
    return scene_.radius[i] > 0 ? scene_.radius[i] : (Site(j) - Site(i)).norm() / 2;
  }

  uint32_t VertexOf(uint32_t inner, uint32_t outer) const {
    const auto edge = std::lower_bound(edges_.begin(), edges_.end(), CutEdge(inner, outer));
    return static_cast<uint32_t>(edge - edges_.begin());
  }

  const ExportableScene& scene_;
  std::vector<uint8_t> inside_;
  std::vector<CutEdge> edges_;
};

void Untangle(const Triangles& triangles,
              const std::vector<Vector3d>& on_edges,
              std::vector<Vector3d>* positions) {
  for (bool moved = true; moved;) {
    moved = false;
    for (const uint32_t f : SelfIntersections(*positions, triangles)) {
      for (const uint32_t v : triangles[f]) {
        moved |= (*positions)[v] != on_edges[v];
        (*positions)[v] = on_edges[v];
      }
    }
  }
}

}  // namespace

ObjectSurface ExtractSmoothSurface(const ExportableScene& scene,
                                   const ObjectInfo& object,
                                   const ObjectSurface& cells) {
  const Builder builder(scene, object);
  const std::vector<Vector3d> on_edges = builder.PointsOnEdges();
  const std::vector<Vector3d> corners = builder.TrimmedCorners(cells.vertex_tet);

  ObjectSurface surface;
  surface.object_id = object.id;
  surface.object_name = object.name;
  surface.triangles = builder.March(cells.vertex_tet, on_edges);
  std::vector<Vector3d> positions = builder.FaceCentroids(cells, corners, on_edges);
  SmoothKeepingEdges(
      surface.triangles, builder.MaxMoves(), EnclosedVolume(corners, cells.triangles), &positions);
  Untangle(surface.triangles, on_edges, &positions);

  surface.vertices.reserve(positions.size());
  for (size_t v = 0; v < positions.size(); ++v) {
    surface.vertices.push_back(scene.FileFromNormalized(positions[v]));
    const uint32_t cell = builder.edges()[v].first;
    surface.vertex_color.push_back(ToColor8(scene.display_color[cell]));
    surface.vertex_confidence.push_back(scene.labels.confidence[cell]);
  }
  ShowVerticesOnFaces(&surface);
  return surface;
}

}  // namespace semfoam
