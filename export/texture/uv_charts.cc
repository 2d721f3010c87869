// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/texture/uv_charts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

#include <Eigen/Geometry>

namespace semfoam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Triangle = std::array<uint32_t, 3>;

// The mean of 1 - cosine in a chart, and in one that takes up a tiny neighbour.
constexpr double kMostBent = 0.2;
constexpr double kMostBentForTiny = 0.35;
// Shares of the surface's area below which a chart is tiny, and too small to be one in any case.
constexpr double kTinyShare = 1e-3;
constexpr double kCrumbShare = 2e-5;
// What the square of a chart's outline counts, against areas.
constexpr double kOutlineWeight = 0.01;
constexpr int kNormalSmoothings = 3;
// Cells along the longer side of a chart when it is examined for overlaps, and how many cells parts
// of it that cover each other must be apart.
constexpr int kOverlapCells = 256;
constexpr double kCellsApart = 8;
constexpr int kMostSplits = 4;
// Share of the surface's area below which a covered part stays.
constexpr double kCoveredShare = 2e-4;

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

// Sides that two faces share; sides of one face alone, or of more than two, are left out.
struct SharedSide {
  uint32_t faces[2];
  double length;
};

std::vector<SharedSide> SharedSides(std::span<const Vector3d> vertices,
                                    std::span<const Triangle> triangles) {
  struct Side {
    uint32_t low, high, face;
    bool operator<(const Side& other) const {
      return std::tie(low, high, face) < std::tie(other.low, other.high, other.face);
    }
  };
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (uint32_t f = 0; f < triangles.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangles[f][k], triangles[f][(k + 1) % 3]);
      sides.push_back({low, high, f});
    }
  }
  std::sort(sides.begin(), sides.end());
  std::vector<SharedSide> shared;
  shared.reserve(sides.size() / 2);
  for (size_t i = 0; i < sides.size();) {
    size_t end = i + 1;
    while (end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high)
      ++end;
    if (end == i + 2) {
      shared.push_back({{sides[i].face, sides[i + 1].face},
                        (vertices[sides[i].low] - vertices[sides[i].high]).norm()});
    }
    i = end;
  }
  return shared;
}

// Twice the area times the normal of each face.
std::vector<Vector3d> Areas(std::span<const Vector3d> vertices,
                            std::span<const Triangle> triangles) {
  std::vector<Vector3d> areas;
  for (const auto& [a, b, c] : triangles) {
    areas.push_back((vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]));
  }
  return areas;
}

// The same with normals that are smoothed over the faces that share a side.
std::vector<Vector3d> SmoothedAreas(const std::vector<Vector3d>& areas,
                                    const std::vector<SharedSide>& sides) {
  std::vector<Vector3d> smooth = areas;
  for (int round = 0; round < kNormalSmoothings; ++round) {
    std::vector<Vector3d> sums = smooth;
    for (const SharedSide& side : sides) {
      sums[side.faces[0]] += smooth[side.faces[1]];
      sums[side.faces[1]] += smooth[side.faces[0]];
    }
    smooth = std::move(sums);
  }
  for (size_t f = 0; f < areas.size(); ++f) {
    smooth[f] = areas[f].norm() * smooth[f].stableNormalized();
  }
  return smooth;
}

// Joins faces into charts.
class ChartClusters {
 public:
  ChartClusters(const std::vector<Vector3d>& areas, const std::vector<SharedSide>& sides)
      : charts_(areas.size()), parent_(areas.size()) {
    std::iota(parent_.begin(), parent_.end(), 0);
    for (uint32_t f = 0; f < areas.size(); ++f) {
      charts_[f].normal = areas[f];
      charts_[f].area = areas[f].norm();
      total_ += charts_[f].area;
    }
    for (const SharedSide& side : sides) {
      for (int k = 0; k < 2; ++k) {
        charts_[side.faces[k]].neighbors.push_back({side.faces[1 - k], side.length});
        charts_[side.faces[k]].outline += side.length;
      }
    }
    for (uint32_t f = 0; f < areas.size(); ++f) {
      SortNeighbors(&charts_[f].neighbors);
      for (const Neighbor& neighbor : charts_[f].neighbors) {
        if (f < neighbor.chart) Consider(f, neighbor);
      }
    }
    JoinAll();
  }

  // Returns the number of the chart of each face, from 0 on in the order of their first faces.
  std::vector<uint32_t> Numbers() {
    std::vector<uint32_t> number(parent_.size(), kNone), of_face(parent_.size());
    uint32_t next = 0;
    for (uint32_t f = 0; f < parent_.size(); ++f) {
      uint32_t& n = number[Find(f)];
      if (n == kNone) n = next++;
      of_face[f] = n;
    }
    return of_face;
  }

 private:
  struct Neighbor {
    uint32_t chart;
    double length;
  };
  struct Chart {
    Vector3d normal;  // sum over the faces of area times normal
    double area = 0;
    double outline = 0;
    uint32_t version = 0;
    std::vector<Neighbor> neighbors;  // by chart
  };
  struct Pair {
    double cost;
    uint32_t a, b;
    uint32_t version_a, version_b;
    bool operator<(const Pair& other) const {  // the least cost first
      return std::tie(other.cost, other.a, other.b) < std::tie(cost, a, b);
    }
  };

  static void SortNeighbors(std::vector<Neighbor>* neighbors) {
    std::stable_sort(neighbors->begin(),
                     neighbors->end(),
                     [](const Neighbor& x, const Neighbor& y) { return x.chart < y.chart; });
    size_t kept = 0;
    for (size_t i = 0; i < neighbors->size(); ++i) {
      if (kept > 0 && (*neighbors)[kept - 1].chart == (*neighbors)[i].chart) {
        (*neighbors)[kept - 1].length += (*neighbors)[i].length;
      } else {
        (*neighbors)[kept++] = (*neighbors)[i];
      }
    }
    neighbors->resize(kept);
  }

  uint32_t Find(uint32_t f) {
    while (parent_[f] != f) f = parent_[f] = parent_[parent_[f]];
    return f;
  }

  void Consider(uint32_t a, const Neighbor& neighbor) {
    const uint32_t b = neighbor.chart;
    const Chart &x = charts_[a], &y = charts_[b];
    const double area = x.area + y.area;
    const double bent = area - (x.normal + y.normal).norm();
    const double smaller = std::min(x.area, y.area);
    if (smaller > kCrumbShare * total_) {
      const double most = smaller < kTinyShare * total_ ? kMostBentForTiny : kMostBent;
      if (bent > most * area) return;
    }
    const double outline = x.outline + y.outline - 2 * neighbor.length;
    const double cost = bent + kOutlineWeight * outline * outline;
    const auto [low, high] = std::minmax(a, b);
    queue_.push({cost, low, high, charts_[low].version, charts_[high].version});
  }

  void JoinAll() {
    while (!queue_.empty()) {
      const Pair pair = queue_.top();
      queue_.pop();
      if (parent_[pair.a] != pair.a || parent_[pair.b] != pair.b) continue;
      if (charts_[pair.a].version != pair.version_a || charts_[pair.b].version != pair.version_b) {
        continue;
      }
      Join(pair.a, pair.b);
    }
  }

  void Join(uint32_t a, uint32_t b) {
    Chart& into = charts_[a];
    Chart& from = charts_[b];
    parent_[b] = a;
    ++into.version;
    into.normal += from.normal;
    into.area += from.area;
    into.outline += from.outline;
    std::vector<Neighbor> neighbors;
    for (const auto* chart : {&into, &from}) {
      for (const Neighbor& neighbor : chart->neighbors) {
        if (neighbor.chart == a || neighbor.chart == b) {
          into.outline -= neighbor.length;  // it is listed from both sides
        } else {
          neighbors.push_back(neighbor);
        }
      }
    }
    SortNeighbors(&neighbors);
    from.neighbors = {};
    into.neighbors = std::move(neighbors);
    for (const Neighbor& neighbor : into.neighbors) {
      auto& back = charts_[neighbor.chart].neighbors;
      std::erase_if(back, [&](const Neighbor& n) { return n.chart == a || n.chart == b; });
      const auto at = std::lower_bound(
          back.begin(), back.end(), a, [](const Neighbor& n, uint32_t c) { return n.chart < c; });
      back.insert(at, {a, neighbor.length});
      Consider(a, neighbor);
    }
  }

  std::vector<Chart> charts_;
  std::vector<uint32_t> parent_;
  std::priority_queue<Pair> queue_;
  double total_ = 0;
};

// The faces of each chart.
std::vector<std::vector<uint32_t>> FacesOfCharts(const std::vector<uint32_t>& chart_of) {
  std::vector<std::vector<uint32_t>> faces;
  for (uint32_t f = 0; f < chart_of.size(); ++f) {
    if (chart_of[f] >= faces.size()) faces.resize(chart_of[f] + 1);
    faces[chart_of[f]].push_back(f);
  }
  return faces;
}

// The plane that a chart is projected onto.
struct Projection {
  Vector3d origin = Vector3d::Zero(), x = Vector3d::UnitX(), y = Vector3d::UnitY(),
           z = Vector3d::UnitZ();

  Vector2d Apply(const Vector3d& v) const { return {x.dot(v - origin), y.dot(v - origin)}; }
};

Projection ProjectionOf(const std::vector<uint32_t>& faces,
                        std::span<const Vector3d> vertices,
                        std::span<const Triangle> triangles,
                        const std::vector<Vector3d>& areas) {
  Projection projection;
  projection.origin = vertices[triangles[faces[0]][0]];
  Vector3d sum = Vector3d::Zero();
  for (const uint32_t f : faces) sum += areas[f];
  if (sum.norm() > 0) projection.z = sum.normalized();
  projection.x = projection.z.unitOrthogonal();
  projection.y = projection.z.cross(projection.x);
  // The turn with the least box.
  constexpr int kTurns = 18;  // of 90 degrees
  double least = std::numeric_limits<double>::infinity();
  double best = 0;
  for (int turn = 0; turn < kTurns; ++turn) {
    const double angle = turn * std::numbers::pi / 2 / kTurns;
    const Eigen::Matrix2d rotation = Eigen::Rotation2Dd(angle).toRotationMatrix();
    Eigen::AlignedBox2d box;
    for (const uint32_t f : faces) {
      for (const uint32_t v : triangles[f]) box.extend(rotation * projection.Apply(vertices[v]));
    }
    if (box.volume() < least * (1 - 1e-9)) {
      least = box.volume();
      best = angle;
    }
  }
  const double c = std::cos(best), s = std::sin(best);
  const Vector3d x = c * projection.x - s * projection.y;
  const Vector3d y = s * projection.x + c * projection.y;
  projection.x = x;
  projection.y = y;
  return projection;
}

// Returns the faces of a chart whose projections are covered by parts of the chart that are far
// above them.
std::vector<uint32_t> CoveredFaces(const std::vector<uint32_t>& faces,
                                   const Projection& projection,
                                   std::span<const Vector3d> vertices,
                                   std::span<const Triangle> triangles) {
  Eigen::AlignedBox2d box;
  for (const uint32_t f : faces) {
    for (const uint32_t v : triangles[f]) box.extend(projection.Apply(vertices[v]));
  }
  const double cell = box.sizes().maxCoeff() / kOverlapCells;
  if (!(cell > 0)) return {};
  const int width = static_cast<int>(box.sizes().x() / cell) + 1;
  const int height = static_cast<int>(box.sizes().y() / cell) + 1;
  // Height above the plane of the highest face over each cell; visits the cells whose centres a
  // face covers.
  std::vector<double> highest(static_cast<size_t>(width) * height,
                              -std::numeric_limits<double>::infinity());
  const auto visit = [&](uint32_t f, const auto& at) {
    Vector2d p[3];
    double z[3];
    for (int k = 0; k < 3; ++k) {
      const Vector3d& v = vertices[triangles[f][k]];
      p[k] = (projection.Apply(v) - box.min()) / cell;
      z[k] = projection.z.dot(v - projection.origin);
    }
    const Vector2d e1 = p[1] - p[0], e2 = p[2] - p[0];
    const double area = e1.x() * e2.y() - e1.y() * e2.x();
    if (area == 0) return;
    const Vector2d low = p[0].cwiseMin(p[1]).cwiseMin(p[2]);
    const Vector2d high = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
    for (int y = std::max(0, static_cast<int>(std::ceil(low.y() - 0.5)));
         y < std::min<double>(height, high.y() + 0.5);
         ++y) {
      for (int x = std::max(0, static_cast<int>(std::ceil(low.x() - 0.5)));
           x < std::min<double>(width, high.x() + 0.5);
           ++x) {
        const Vector2d d = Vector2d(x + 0.5, y + 0.5) - p[0];
        const double b = (d.x() * e2.y() - d.y() * e2.x()) / area;
        const double c = (e1.x() * d.y() - e1.y() * d.x()) / area;
        if (b < 0 || c < 0 || b + c > 1) continue;
        at(&highest[static_cast<size_t>(y) * width + x], (1 - b - c) * z[0] + b * z[1] + c * z[2]);
      }
    }
  };
  for (const uint32_t f : faces) {
    visit(f, [](double* top, double z) { *top = std::max(*top, z); });
  }
  std::vector<uint32_t> covered;
  for (const uint32_t f : faces) {
    bool is_covered = false;
    visit(f, [&](const double* top, double z) { is_covered |= *top - z > kCellsApart * cell; });
    if (is_covered) covered.push_back(f);
  }
  return covered;
}

// Gives the connected parts of `covered` (faces of chart `chart`) numbers of their own, from `next`
// on; parts with less than `least_area` stay. Returns the next number.
uint32_t NumberParts(const std::vector<uint32_t>& covered,
                     uint32_t chart,
                     const std::vector<std::vector<uint32_t>>& faces_around,
                     const std::vector<Vector3d>& areas,
                     double least_area,
                     uint32_t next,
                     std::vector<uint32_t>* chart_of) {
  for (const uint32_t f : covered) (*chart_of)[f] = kNone;
  for (const uint32_t first : covered) {
    if ((*chart_of)[first] != kNone) continue;
    std::vector<uint32_t> part = {first};
    (*chart_of)[first] = next;
    double area = 0;
    for (size_t i = 0; i < part.size(); ++i) {
      area += areas[part[i]].norm();
      for (const uint32_t other : faces_around[part[i]]) {
        if ((*chart_of)[other] != kNone) continue;
        (*chart_of)[other] = next;
        part.push_back(other);
      }
    }
    if (area < least_area) {
      for (const uint32_t f : part) (*chart_of)[f] = chart;
    } else {
      ++next;
    }
  }
  return next;
}

}  // namespace

UvCharts MakeUvCharts(std::span<const Vector3d> vertices, std::span<const Triangle> triangles) {
  UvCharts charts;
  if (triangles.empty()) return charts;
  const std::vector<SharedSide> sides = SharedSides(vertices, triangles);
  const std::vector<Vector3d> areas = Areas(vertices, triangles);
  charts.chart_of = ChartClusters(SmoothedAreas(areas, sides), sides).Numbers();

  std::vector<std::vector<uint32_t>> faces_around(triangles.size());
  for (const SharedSide& side : sides) {
    faces_around[side.faces[0]].push_back(side.faces[1]);
    faces_around[side.faces[1]].push_back(side.faces[0]);
  }
  double least_area = 0;
  for (const Vector3d& area : areas) least_area += kCoveredShare * area.norm();
  std::vector<std::vector<uint32_t>> faces = FacesOfCharts(charts.chart_of);
  for (int round = 0; round < kMostSplits; ++round) {
    const auto count = static_cast<uint32_t>(faces.size());
    uint32_t next = count;
    for (uint32_t c = 0; c < count; ++c) {
      const std::vector<uint32_t> covered = CoveredFaces(
          faces[c], ProjectionOf(faces[c], vertices, triangles, areas), vertices, triangles);
      if (covered.empty() || covered.size() == faces[c].size()) continue;
      next = NumberParts(covered, c, faces_around, areas, least_area, next, &charts.chart_of);
    }
    if (next == count) break;
    faces = FacesOfCharts(charts.chart_of);
  }

  charts.triangles.resize(triangles.size());
  for (const std::vector<uint32_t>& of_chart : faces) {
    const Projection projection = ProjectionOf(of_chart, vertices, triangles, areas);
    std::map<uint32_t, uint32_t> point_of;
    Eigen::AlignedBox2d box;
    const auto first = charts.points.size();
    for (const uint32_t f : of_chart) {
      for (int k = 0; k < 3; ++k) {
        const uint32_t v = triangles[f][k];
        const auto [at, is_new] = point_of.emplace(v, static_cast<uint32_t>(charts.points.size()));
        if (is_new) {
          charts.points.push_back(projection.Apply(vertices[v]));
          charts.vertex_of.push_back(v);
          box.extend(charts.points.back());
        }
        charts.triangles[f][k] = at->second;
      }
    }
    for (size_t p = first; p < charts.points.size(); ++p) charts.points[p] -= box.min();
    charts.sizes.push_back(box.sizes());
  }
  return charts;
}

}  // namespace semfoam
