// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/open_sheet.h"

#include "foam/util/median.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;

// Share of the shown area below which hidden patches stay, and below which shown pieces go.
constexpr double kSmallPatch = 1e-3;
constexpr double kSmallPiece = 3e-3;
// Number of median lengths from which on a side at the rim is long: of an object, and of a scene,
// whose things have cells of very different sizes.
constexpr double kLongSide = 5;
constexpr double kLongSideOfScene = 15;

constexpr uint32_t kNoFace = 0xffffffff;

double Area(const ObjectSurface& surface, const std::array<uint32_t, 3>& t) {
  const Vector3d& a = surface.vertices[t[0]];
  return (surface.vertices[t[1]] - a).cross(surface.vertices[t[2]] - a).norm() / 2;
}

// Whether photos show a face, or the plane that it lies in.
bool IsShown(const ObjectSurface& surface, const std::array<uint32_t, 3>& t) {
  int count = 0;
  for (const uint32_t v : t) count += surface.vertex_shown[v] || surface.vertex_flat[v];
  return count >= 2;
}

// For each side k of a face, from its corner k to the next one, the face behind it; kNoFace at a
// rim.
std::vector<std::array<uint32_t, 3>> FacesBehindSides(const ObjectSurface& surface) {
  struct Side {
    std::array<uint32_t, 2> ends;
    uint32_t face;
    uint32_t corner;
  };
  std::vector<Side> sides;
  for (uint32_t f = 0; f < surface.triangles.size(); ++f) {
    const auto& t = surface.triangles[f];
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t a = t[k], b = t[(k + 1) % 3];
      sides.push_back({{std::min(a, b), std::max(a, b)}, f, k});
    }
  }
  std::stable_sort(
      sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.ends < b.ends; });
  std::vector<std::array<uint32_t, 3>> behind(surface.triangles.size(),
                                              {kNoFace, kNoFace, kNoFace});
  for (size_t k = 0; k + 1 < sides.size(); ++k) {
    const Side &a = sides[k], &b = sides[k + 1];
    if (a.ends != b.ends) continue;
    behind[a.face][a.corner] = b.face;
    behind[b.face][b.corner] = a.face;
  }
  return behind;
}

uint32_t Root(std::vector<uint32_t>* parent, uint32_t k) {
  while ((*parent)[k] != k) {
    (*parent)[k] = (*parent)[(*parent)[k]];
    k = (*parent)[k];
  }
  return k;
}

void Join(std::vector<uint32_t>* parent, uint32_t a, uint32_t b) {
  a = Root(parent, a);
  b = Root(parent, b);
  (*parent)[std::max(a, b)] = std::min(a, b);
}

std::vector<uint32_t> Alone(size_t n) {
  std::vector<uint32_t> parent(n);
  std::iota(parent.begin(), parent.end(), 0u);
  return parent;
}

// Changes the side of the pieces of connected faces that are `from` and have less than `area`.
void FlipSmallPieces(const ObjectSurface& surface,
                     const std::vector<std::array<uint32_t, 3>>& behind,
                     uint8_t from,
                     double area,
                     std::vector<uint8_t>* is_shown) {
  std::vector<uint32_t> parent = Alone(behind.size());
  for (uint32_t f = 0; f < behind.size(); ++f) {
    if ((*is_shown)[f] != from) continue;
    for (const uint32_t g : behind[f]) {
      if (g != kNoFace && (*is_shown)[g] == from) Join(&parent, f, g);
    }
  }
  std::vector<double> areas(behind.size(), 0);
  for (uint32_t f = 0; f < behind.size(); ++f) {
    areas[Root(&parent, f)] += Area(surface, surface.triangles[f]);
  }
  for (uint32_t f = 0; f < behind.size(); ++f) {
    if ((*is_shown)[f] == from && areas[Root(&parent, f)] < area) (*is_shown)[f] = !from;
  }
}

double SquaredSide(const ObjectSurface& surface, const std::array<uint32_t, 3>& t, int k) {
  return (surface.vertices[t[k]] - surface.vertices[t[(k + 1) % 3]]).squaredNorm();
}

bool IsFlat(const ObjectSurface& surface, uint32_t face) {
  const auto& [a, b, c] = surface.triangles[face];
  return surface.vertex_flat[a] && surface.vertex_flat[b] && surface.vertex_flat[c];
}

// Takes away the faces at the rim that have a long side, then those that come to lie there.
void RemoveLongFaces(const ObjectSurface& surface,
                     const std::vector<std::array<uint32_t, 3>>& behind,
                     std::vector<uint8_t>* is_shown) {
  std::vector<double> lengths, longest(behind.size(), 0);
  for (uint32_t f = 0; f < behind.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const double length = SquaredSide(surface, surface.triangles[f], k);
      longest[f] = std::max(longest[f], length);
      if ((*is_shown)[f]) lengths.push_back(length);
    }
  }
  if (lengths.empty()) return;
  const double long_side = surface.object_id == kNoObject ? kLongSideOfScene : kLongSide;
  const double limit = long_side * long_side * Median(std::move(lengths));
  std::vector<uint32_t> to_look_at;
  for (uint32_t f = 0; f < behind.size(); ++f) {
    if (!(*is_shown)[f]) to_look_at.push_back(f);
  }
  for (size_t k = 0; k < to_look_at.size(); ++k) {
    for (const uint32_t g : behind[to_look_at[k]]) {
      if (g == kNoFace || !(*is_shown)[g] || longest[g] <= limit || IsFlat(surface, g)) continue;
      (*is_shown)[g] = 0;
      to_look_at.push_back(g);
    }
  }
}

}  // namespace

bool IsSheet(const ObjectSurface& surface, bool is_cut) {
  const size_t n = surface.vertices.size();
  CHECK_EQ(surface.vertex_shown.size(), n);
  CHECK_EQ(surface.vertex_in_contact.size(), n);
  CHECK_EQ(surface.vertex_flat.size(), n);
  double shown = 0, flat = 0, all = 0;
  for (const auto& t : surface.triangles) {
    const auto has = [&](const std::vector<uint8_t>& of_vertex) {
      return of_vertex[t[0]] + of_vertex[t[1]] + of_vertex[t[2]] >= 2;
    };
    if (has(surface.vertex_in_contact)) continue;
    const double area = Area(surface, t);
    all += area;
    if (!has(surface.vertex_shown)) continue;
    shown += area;
    if (has(surface.vertex_flat)) flat += area;
  }
  return shown > 0 && shown < kMostShownOfSheet * all &&
         (is_cut || flat >= kLeastFlatOfSheet * shown);
}

ObjectSurface OpenSheet(const ObjectSurface& surface) {
  CHECK_EQ(surface.vertex_shown.size(), surface.vertices.size());
  CHECK_EQ(surface.vertex_flat.size(), surface.vertices.size());
  const size_t num_faces = surface.triangles.size();
  const auto behind = FacesBehindSides(surface);
  std::vector<uint8_t> is_shown(num_faces);
  double area = 0;
  for (size_t f = 0; f < num_faces; ++f) {
    is_shown[f] = IsShown(surface, surface.triangles[f]);
    if (is_shown[f]) area += Area(surface, surface.triangles[f]);
  }
  FlipSmallPieces(surface, behind, 0, kSmallPatch * area, &is_shown);
  RemoveLongFaces(surface, behind, &is_shown);
  FlipSmallPieces(surface, behind, 1, kSmallPiece * area, &is_shown);

  // A corner of a face and the one of the next face around the same vertex are one vertex.
  std::vector<uint32_t> parent = Alone(3 * num_faces);
  for (uint32_t f = 0; f < num_faces; ++f) {
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t g = behind[f][k];
      if (!is_shown[f] || g == kNoFace || !is_shown[g]) continue;
      for (const uint32_t corner : {k, (k + 1) % 3}) {
        for (uint32_t other = 0; other < 3; ++other) {
          if (surface.triangles[g][other] == surface.triangles[f][corner]) {
            Join(&parent, 3 * f + corner, 3 * g + other);
          }
        }
      }
    }
  }
  struct Corner {
    uint32_t vertex;
    uint32_t root;
  };
  std::vector<Corner> corners;
  for (uint32_t f = 0; f < num_faces; ++f) {
    for (uint32_t k = 0; is_shown[f] && k < 3; ++k) {
      if (parent[3 * f + k] == 3 * f + k) {
        corners.push_back({surface.triangles[f][k], 3 * f + k});
      }
    }
  }
  std::stable_sort(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
    return a.vertex < b.vertex;
  });
  ObjectSurface sheet;
  sheet.object_id = surface.object_id;
  sheet.object_name = surface.object_name;
  std::vector<uint32_t> new_index(3 * num_faces, 0);
  for (const Corner& corner : corners) {
    new_index[corner.root] = static_cast<uint32_t>(sheet.vertices.size());
    sheet.vertices.push_back(surface.vertices[corner.vertex]);
    sheet.vertex_color.push_back(surface.vertex_color[corner.vertex]);
    sheet.vertex_confidence.push_back(surface.vertex_confidence[corner.vertex]);
    sheet.vertex_shown.push_back(surface.vertex_shown[corner.vertex]);
    sheet.vertex_flat.push_back(surface.vertex_flat[corner.vertex]);
  }
  for (uint32_t f = 0; f < num_faces; ++f) {
    if (!is_shown[f]) continue;
    std::array<uint32_t, 3>& triangle = sheet.triangles.emplace_back();
    for (uint32_t k = 0; k < 3; ++k) triangle[k] = new_index[Root(&parent, 3 * f + k)];
  }
  ShowVerticesOnFaces(&sheet);
  return sheet;
}

SheetTopology TopologyOfSheet(const ObjectSurface& sheet) {
  const auto behind = FacesBehindSides(sheet);
  std::vector<uint32_t> pieces = Alone(sheet.vertices.size());
  std::vector<uint32_t> rims = Alone(sheet.vertices.size());
  std::vector<uint8_t> is_at_rim(sheet.vertices.size(), 0);
  for (uint32_t f = 0; f < behind.size(); ++f) {
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t a = sheet.triangles[f][k], b = sheet.triangles[f][(k + 1) % 3];
      Join(&pieces, a, b);
      if (behind[f][k] != kNoFace) continue;
      is_at_rim[a] = is_at_rim[b] = 1;
      Join(&rims, a, b);
    }
  }
  SheetTopology topology;
  for (uint32_t v = 0; v < sheet.vertices.size(); ++v) {
    if (pieces[v] == v) ++topology.pieces;
    if (is_at_rim[v] && rims[v] == v) ++topology.rims;
  }
  return topology;
}

}  // namespace semfoam
