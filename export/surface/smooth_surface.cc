// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/smooth_surface.h"

#include "export/surface/even_triangles.h"
#include "export/surface/flat_parts.h"
#include "export/surface/surface_geometry.h"
#include "export/surface/surface_smoothing.h"
#include "foam/util/parallel.h"

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
// The same where no photo shows what is beyond: behind walls and below floors.
constexpr double kUnseenRadii = 1;
// The same where the object ends in a contact.
constexpr double kContactRadii = 2;
// A vertex is in a contact's plane within this share of its length, for rounding; steps of
// averaging there.
constexpr double kInPlane = 1e-6;
constexpr int kContactSteps = 4;
constexpr int64_t kBlock = 1024;
// How far a vertex may move, as a share of its cell's radius and of its half edge.
constexpr double kMaxMove = 0.9;
// The light that passes haze, by that which stops in it.
constexpr float kHazePassed = 4;

// Optical depth at which the surface lies: training leaves a thin layer of little density before
// what one sees. And what share of the way through thinner matter it lies at.
constexpr double kSurfaceOpticalDepth = 0.07;
constexpr double kThinShare = 0.3;
// It is no deeper than that many radii of the cell: where matter is thinner, as in glossy things,
// training has spread it behind the surface.
constexpr double kMaxDepthRadii = 1;
// Steps of averaging of the normals and of the depths over neighbours.
constexpr int kNormalSteps = 2;
constexpr int kDepthSteps = 3;

// From a site of the object to one that is not.
using CutEdge = std::pair<uint32_t, uint32_t>;

// Everything here is in the normalised frame, where rounding is the same wherever the scene lies.
class Builder {
 public:
  Builder(const ExportableScene& scene,
          const ObjectInfo& object,
          const Eigen::AlignedBox3d& box,
          const std::vector<ContactPlane>& contacts)
      : scene_(scene), box_(box), contacts_(contacts), inside_(scene.delaunay.num_cells, 0) {
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

  // The middles of the edges, or nearer to the object's site, where the other is so far off that
  // the middle would be a spike, or where the edge leaves the box.
  std::vector<Vector3d> PointsOnEdges() const {
    std::vector<Vector3d> points;
    points.reserve(edges_.size());
    for (const auto& [i, j] : edges_) {
      const Vector3d edge = Site(j) - Site(i);
      const double reach = IsUnseen(j) ? kUnseenRadii : kSpikeRadii;
      const double middle = std::min(0.5, reach * Radius(i, j) / edge.norm());
      const double end = ShareWithin(i, j);
      points.push_back(Site(i) +
                       (IsCut(i, j) || EndsInContact(i, j) ? end : std::min(middle, end)) * edge);
    }
    return points;
  }

  // Whether the box or a contact, and nothing else, separates the two cells of an edge, or its end
  // is nearer than the middle, or the edge leads through a contact into what no photo shows: then
  // the vertex stays in the plane that cuts.
  bool IsFixed(size_t v) const {
    const auto& [i, j] = edges_[v];
    return IsCut(i, j) || EndsInContact(i, j) || ShareWithin(i, j) < 0.5;
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
      bool is_unseen = true;
      for (const uint32_t cell : scene_.delaunay.tets[tet]) {
        if (!inside_[cell]) is_unseen &= IsUnseen(cell);
        if (!inside_[cell]) continue;
        site += Site(cell);
        radius += scene_.radius[cell];
        ++count;
      }
      site /= count;
      const double limit = (is_unseen ? kUnseenRadii : kSpikeRadii) * radius / count;
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

  // How far the light goes from a point on the boundary of vertex v's cell, in a direction into it,
  // until the optical depth kSurfaceOpticalDepth; at most kMaxDepthRadii radii. Where it leaves the
  // object before, a share of the way, so that the two sides of thin matter do not meet.
  double LightDepth(size_t v, const Vector3d& from, const Vector3d& direction) const {
    uint32_t cell = edges_[v].first;
    const double farthest = kMaxDepthRadii * Radius(cell, edges_[v].second);
    double t = 0, left = kSurfaceOpticalDepth;
    // Each step goes to a site farther along the direction, so it ends.
    while (true) {
      const Vector3d r = from - Site(cell);
      double t_out = farthest;
      uint32_t next = cell;
      for (const uint32_t j : scene_.delaunay.Neighbors(cell)) {
        const Vector3d n = Site(j) - Site(cell);
        const double slope = n.dot(direction);
        if (!(slope > 0)) continue;
        const double t_j = std::max(t, (n.squaredNorm() / 2 - r.dot(n)) / slope);
        if (t_j < t_out) {
          t_out = t_j;
          next = j;
        }
      }
      const double depth = scene_.density[cell] * (t_out - t);
      if (depth >= left) return t + left / scene_.density[cell];
      left -= depth;
      t = t_out;
      if (next == cell) return farthest;
      if (!inside_[next]) return kThinShare * t;
      cell = next;
    }
  }

  // Whether photos look at a vertex from outside: their rays cross the outer cell, which is no
  // other object's.
  bool IsShown(size_t v) const { return IsLookedThrough(edges_[v].second); }

  std::vector<uint8_t> Shown() const {
    std::vector<uint8_t> shown(edges_.size());
    for (size_t v = 0; v < edges_.size(); ++v) shown[v] = IsShown(v);
    return shown;
  }

  // Radii of the cells behind the vertices.
  std::vector<double> Radii() const {
    std::vector<double> radii;
    radii.reserve(edges_.size());
    for (const auto& [i, j] : edges_) radii.push_back(Radius(i, j));
    return radii;
  }

  // The contact in whose plane a vertex lies, if there is one.
  const ContactPlane* ContactOf(size_t v, const Vector3d& position) const {
    if (!IsFixed(v)) return nullptr;
    for (const ContactPlane& contact : contacts_) {
      if (contact.plane.absDistance(position) < kInPlane * contact.length) return &contact;
    }
    return nullptr;
  }

  // Where vertices may move to, to remove dents and bumps: matter stays, haze need not.
  std::vector<VertexMove> Moves() const {
    std::vector<VertexMove> moves;
    moves.reserve(edges_.size());
    for (size_t v = 0; v < edges_.size(); ++v) {
      moves.push_back(IsFixed(v)                ? VertexMove::kNone
                      : IsHaze(edges_[v].first) ? VertexMove::kBothWays
                                                : VertexMove::kOutwards);
    }
    return moves;
  }

  // Moves vertices that are not fixed along their edges to between the two sites: no nearer to
  // either than those can come that begin at `on_edges` and move by kMaxMove of the way.
  void KeepBetweenSites(const std::vector<Vector3d>& on_edges,
                        std::vector<Vector3d>* positions) const {
    for (size_t v = 0; v < edges_.size(); ++v) {
      if (IsFixed(v)) continue;
      const auto& [i, j] = edges_[v];
      const Vector3d edge = Site(j) - Site(i);
      const double length = edge.norm();
      if (!(length > 0)) continue;
      const double begin = (1 - kMaxMove) * (on_edges[v] - Site(i)).norm();
      const double end = length - (1 - kMaxMove) * length / 2;
      const double along = ((*positions)[v] - Site(i)).dot(edge) / length;
      (*positions)[v] += (std::clamp(along, begin, end) - along) / length * edge;
    }
  }

  std::vector<double> MaxMoves() const {
    std::vector<double> moves;
    moves.reserve(edges_.size());
    for (size_t v = 0; v < edges_.size(); ++v) {
      const auto& [i, j] = edges_[v];
      moves.push_back(
          IsFixed(v) ? 0 : kMaxMove * std::min(Radius(i, j), (Site(j) - Site(i)).norm() / 2));
    }
    return moves;
  }

 private:
  bool IsHaze(uint32_t cell) const {
    return !scene_.passed.empty() && scene_.passed[cell] > kHazePassed * scene_.stopped[cell];
  }

  bool IsUnseen(uint32_t cell) const { return cell < scene_.NumSites() && !scene_.seen[cell]; }

  bool IsLookedThrough(uint32_t cell) const {
    return cell < scene_.NumSites() && scene_.object_of_cell[cell] < 0 && scene_.crossed[cell];
  }

  // Whether both cells are the object's, but one of them is out of the box or beyond a contact.
  bool IsCut(uint32_t i, uint32_t j) const {
    return j < scene_.NumSites() && scene_.object_of_cell[j] >= 0 &&
           scene_.object_of_cell[j] == scene_.object_of_cell[i] && ShareWithin(i, j) < 1;
  }

  // Whether the cells are on either side of a contact, and near it.
  bool EndsInContact(uint32_t i, uint32_t j) const {
    if (IsLookedThrough(j)) return false;
    for (const ContactPlane& contact : contacts_) {
      if (contact.plane.signedDistance(Site(j)) > 0 &&
          ShareWithin(i, j) * (Site(j) - Site(i)).norm() <= kContactRadii * Radius(i, j)) {
        return true;
      }
    }
    return false;
  }

  // How far an edge from a site in the box, on the object's side of all contacts, stays there, as a
  // share of its length, at most 1.
  double ShareWithin(uint32_t i, uint32_t j) const {
    const Vector3d from = Site(i);
    const Vector3d edge = Site(j) - from;
    double share = 1;
    for (const ContactPlane& contact : contacts_) {
      const double begin = contact.plane.signedDistance(from);
      const double end = contact.plane.signedDistance(from + edge);
      if (end > 0) share = std::min(share, begin / (begin - end));
    }
    for (int axis = 0; axis < 3; ++axis) {
      const double end = from[axis] + edge[axis];
      const double limit = std::clamp(end, box_.min()[axis], box_.max()[axis]);
      if (limit != end) share = std::min(share, (limit - from[axis]) / edge[axis]);
    }
    return share;
  }

  // Of cell i, on its edge to j: a cell without real neighbours has none of its own.
  double Radius(uint32_t i, uint32_t j) const {
    return scene_.radius[i] > 0 ? scene_.radius[i] : (Site(j) - Site(i)).norm() / 2;
  }

  uint32_t VertexOf(uint32_t inner, uint32_t outer) const {
    const auto edge = std::lower_bound(edges_.begin(), edges_.end(), CutEdge(inner, outer));
    return static_cast<uint32_t>(edge - edges_.begin());
  }

  const ExportableScene& scene_;
  const Eigen::AlignedBox3d box_;
  const std::vector<ContactPlane>& contacts_;
  std::vector<uint8_t> inside_;
  std::vector<CutEdge> edges_;
};

// Moves the vertices inwards to where light ends (LightDepth), each by at most `max_moves`.
void DrawIn(const Builder& builder,
            const Triangles& triangles,
            const std::vector<double>& max_moves,
            std::vector<Vector3d>* positions) {
  const size_t n = positions->size();
  std::vector<Vector3d> normals(n, Vector3d::Zero());
  std::vector<double> counts(n, 1);
  for (const auto& triangle : triangles) {
    const auto& [a, b, c] = triangle;
    const Vector3d area =
        ((*positions)[b] - (*positions)[a]).cross((*positions)[c] - (*positions)[a]);
    for (const uint32_t v : triangle) normals[v] += area;
  }
  AddNeighbors(triangles, kNormalSteps, &normals);
  // Zero where there is no direction.
  for (Vector3d& normal : normals) normal = normal.stableNormalized();
  std::vector<double> depths(n);
  ParallelForBlocks(static_cast<int64_t>(n), kBlock, [&](int64_t begin, int64_t end) {
    for (int64_t v = begin; v < end; ++v) {
      depths[v] = builder.LightDepth(v, (*positions)[v], -normals[v]);
    }
  });
  AddNeighbors(triangles, kDepthSteps, &depths);
  AddNeighbors(triangles, kDepthSteps, &counts);
  for (size_t v = 0; v < n; ++v) {
    (*positions)[v] -= std::min(depths[v] / counts[v], max_moves[v]) * normals[v];
  }
}

// Moves the vertices in contacts within their planes, towards the means of their neighbours: the
// line along which an object meets the plane is as ragged as its cells. Along that line neighbours
// farther inside the plane do not count, so that it comes to lie below what stands above it.
void SmoothInContacts(const Builder& builder,
                      const Triangles& triangles,
                      std::vector<Vector3d>* positions) {
  const size_t n = positions->size();
  std::vector<const ContactPlane*> contacts(n);
  bool has_contact = false;
  for (size_t v = 0; v < n; ++v) {
    contacts[v] = builder.ContactOf(v, (*positions)[v]);
    has_contact |= contacts[v] != nullptr;
  }
  if (!has_contact) return;
  std::vector<uint8_t> is_on_line(n, 0);
  for (const auto& triangle : triangles) {
    const bool leaves = std::any_of(
        triangle.begin(), triangle.end(), [&](uint32_t v) { return contacts[v] == nullptr; });
    for (const uint32_t v : triangle) is_on_line[v] |= leaves && contacts[v] != nullptr;
  }
  for (int step = 0; step < kContactSteps; ++step) {
    std::vector<Vector3d> sums = *positions;
    std::vector<double> counts(n, 1);
    for (const auto& triangle : triangles) {
      for (int k = 0; k < 3; ++k) {
        const uint32_t v = triangle[k], next = triangle[(k + 1) % 3];
        if (is_on_line[v] && contacts[next] != nullptr && !is_on_line[next]) continue;
        sums[v] += (*positions)[next];
        ++counts[v];
      }
    }
    for (size_t v = 0; v < n; ++v) {
      if (contacts[v] == nullptr) continue;
      (*positions)[v] = contacts[v]->plane.projection(sums[v] / counts[v]);
    }
  }
}

// Makes the triangles even, and moves the vertices of those that intersect onto their edges, where
// the triangles stay as they were marched.
void EvenAndUntangle(const Triangles& marched,
                     const std::vector<Vector3d>& on_edges,
                     std::vector<Vector3d>* positions,
                     Triangles* triangles) {
  std::vector<uint8_t> is_on_edge(positions->size(), 0);
  for (bool moved = true; moved;) {
    moved = false;
    *triangles = EvenTriangles(marched, *positions, is_on_edge);
    for (const uint32_t f : SelfIntersections(*positions, *triangles)) {
      for (const uint32_t v : (*triangles)[f]) {
        moved |= is_on_edge[v] == 0;
        is_on_edge[v] = 1;
        (*positions)[v] = on_edges[v];
      }
    }
  }
}

}  // namespace

ObjectSurface ExtractSmoothSurface(const ExportableScene& scene,
                                   const ObjectInfo& object,
                                   const ObjectSurface& cells,
                                   const Eigen::AlignedBox3d& box,
                                   const std::vector<ContactPlane>& contacts) {
  const Builder builder(scene, object, box, contacts);
  const std::vector<Vector3d> on_edges = builder.PointsOnEdges();
  const std::vector<Vector3d> corners = builder.TrimmedCorners(cells.vertex_tet);

  ObjectSurface surface;
  surface.object_id = object.id;
  surface.object_name = object.name;
  surface.triangles = builder.March(cells.vertex_tet, on_edges);
  std::vector<Vector3d> positions = builder.FaceCentroids(cells, corners, on_edges);
  std::vector<uint8_t> is_fixed(positions.size());
  bool is_cut = false;
  for (size_t v = 0; v < positions.size(); ++v) {
    is_fixed[v] = builder.IsFixed(v);
    is_cut |= is_fixed[v] != 0;
    if (is_fixed[v] != 0 || !box.contains(positions[v])) positions[v] = on_edges[v];
  }
  std::vector<double> max_moves = builder.MaxMoves();
  const double volume = EnclosedVolume(positions, surface.triangles);
  const std::vector<double> radii = builder.Radii();
  DrawIn(builder, surface.triangles, max_moves, &positions);
  SmoothInContacts(builder, surface.triangles, &positions);
  const double drawn_in = EnclosedVolume(positions, surface.triangles) - volume;
  FairOutliers(surface.triangles, radii, builder.Moves(), &positions);
  SmoothKeepingEdges(surface.triangles,
                     max_moves,
                     drawn_in + (is_cut ? volume : EnclosedVolume(corners, cells.triangles)),
                     &positions);
  builder.KeepBetweenSites(on_edges, &positions);
  SmoothInContacts(builder, surface.triangles, &positions);
  CutSpikes(surface.triangles, is_fixed, &positions);
  const std::vector<FlatPart> flat =
      FindFlatParts({surface.triangles, positions, builder.Shown(), radii});
  surface.vertex_flat = Flatten(flat, surface.triangles, radii, is_fixed, &positions);
  for (Vector3d& x : positions) x = x.cwiseMax(box.min()).cwiseMin(box.max());
  const Triangles marched = surface.triangles;
  EvenAndUntangle(marched, on_edges, &positions, &surface.triangles);

  surface.vertices.reserve(positions.size());
  for (size_t v = 0; v < positions.size(); ++v) {
    surface.vertices.push_back(scene.FileFromNormalized(positions[v]));
    const uint32_t cell = builder.edges()[v].first;
    surface.vertex_color.push_back(ToColor8(scene.display_color[cell]));
    surface.vertex_confidence.push_back(scene.labels.confidence[cell]);
    surface.vertex_shown.push_back(builder.IsShown(v));
    surface.vertex_in_contact.push_back(builder.ContactOf(v, positions[v]) != nullptr);
  }
  ShowVerticesOnFaces(&surface);
  return surface;
}

}  // namespace semfoam
