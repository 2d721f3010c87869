// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/boundary_caps.h"

#include <algorithm>
#include <tuple>

namespace semfoam {
namespace {

// The side of a face, from one vertex to another.
struct HalfEdge {
  uint32_t part = 0;
  uint32_t from = 0;
  uint32_t to = 0;
  uint32_t face = 0;

  auto Undirected() const { return std::tuple(part, std::min(from, to), std::max(from, to)); }
  auto Directed() const { return std::tuple(part, from, to, face); }
};

// Returns the sides that no other face of the part passes the other way.
std::vector<HalfEdge> BoundaryOf(const PolygonMesh& mesh,
                                 const std::vector<uint32_t>& part_of_face,
                                 uint32_t num_parts) {
  std::vector<HalfEdge> edges;
  for (uint32_t f = 0; f < mesh.NumFaces(); ++f) {
    if (part_of_face[f] >= num_parts) continue;
    const std::span<const uint32_t> face = mesh.Face(f);
    for (size_t k = 0; k < face.size(); ++k) {
      const uint32_t next = face[(k + 1) % face.size()];
      if (face[k] != next) edges.push_back({part_of_face[f], face[k], next, f});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tuple(a.Undirected(), a.Directed()) < std::tuple(b.Undirected(), b.Directed());
  });
  std::vector<HalfEdge> boundary;
  for (auto begin = edges.begin(); begin != edges.end();) {
    const auto end = std::find_if(begin, edges.end(), [&](const HalfEdge& edge) {
      return edge.Undirected() != begin->Undirected();
    });
    // Those upwards, then those downwards; the ones that are more are left over.
    const auto middle =
        std::find_if(begin, end, [](const HalfEdge& edge) { return edge.from > edge.to; });
    const auto up = middle - begin, down = end - middle;
    if (up > down) boundary.insert(boundary.end(), begin, begin + (up - down));
    if (down > up) boundary.insert(boundary.end(), middle, middle + (down - up));
    begin = end;
  }
  return boundary;
}

}  // namespace

Eigen::Vector3d BoundaryCap::Center(const PolygonMesh& mesh) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const uint32_t v : loop) sum += mesh.vertices[v] - mesh.vertices[loop[0]];
  return mesh.vertices[loop[0]] + sum / static_cast<double>(loop.size());
}

std::vector<BoundaryCap> FindBoundaryCaps(const PolygonMesh& mesh,
                                          const std::vector<uint32_t>& part_of_face,
                                          uint32_t num_parts) {
  // The cap passes each edge the other way.
  std::vector<HalfEdge> edges = BoundaryOf(mesh, part_of_face, num_parts);
  for (HalfEdge& edge : edges) std::swap(edge.from, edge.to);
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return a.Directed() < b.Directed();
  });
  std::vector<uint8_t> is_used(edges.size(), 0);
  // Returns an unused edge from the vertex, or edges.size().
  const auto next_from = [&](uint32_t part, uint32_t vertex) {
    auto at = std::lower_bound(edges.begin(),
                               edges.end(),
                               std::pair(part, vertex),
                               [](const HalfEdge& edge, const auto& key) {
                                 return std::pair(edge.part, edge.from) < key;
                               });
    for (; at != edges.end() && at->part == part && at->from == vertex; ++at) {
      if (!is_used[at - edges.begin()]) return static_cast<size_t>(at - edges.begin());
    }
    return edges.size();
  };
  std::vector<BoundaryCap> caps;
  std::vector<uint8_t> is_on_path(mesh.vertices.size(), 0);
  std::vector<size_t> path;
  for (size_t first = 0; first < edges.size(); ++first) {
    path.clear();
    for (size_t edge = first; edge < edges.size() && !is_used[edge];
         edge = next_from(edges[edge].part, edges[edge].to)) {
      is_used[edge] = 1;
      path.push_back(edge);
      is_on_path[edges[edge].from] = 1;
      if (!is_on_path[edges[edge].to]) continue;
      // A loop is closed: it leaves the path, which goes on from where it began.
      BoundaryCap cap{edges[edge].part, edges[edge].face, {}};
      const uint32_t last = edges[edge].to;
      uint32_t from;
      do {
        from = edges[path.back()].from;
        is_on_path[from] = 0;
        cap.loop.push_back(from);
        path.pop_back();
      } while (from != last);
      std::reverse(cap.loop.begin(), cap.loop.end());
      if (cap.loop.size() >= 3) caps.push_back(std::move(cap));
    }
    for (const size_t edge : path) is_on_path[edges[edge].from] = 0;
  }
  return caps;
}

}  // namespace semfoam
