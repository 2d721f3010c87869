// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/surface_smoothing.h"

#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;

// Found on the objects of `tabletop` (export/README.md). Normals whose difference has this length
// (20 degrees apart) count 1 / sqrt(e).
constexpr double kNormalSigma = 0.35;
constexpr int kNormalSteps = 10;
constexpr int kVertexSteps = 10;
constexpr double kUmbrellaStep = 0.5;
constexpr int kVolumeSteps = 3;
// What bending counts beside distances, in thin plates; it bridges what is up to some six edges
// wide. Steps of the descent; those after which vertices begin to count by their distance, and
// those from one such weight to the next.
constexpr double kBending = 16;
constexpr int kPlateSteps = 60;
constexpr int kFirstWeights = 20;
constexpr int kStepsOfWeights = 5;
constexpr int kSpikeSteps = 5;
constexpr double kSpikeStep = 0.75;
constexpr int64_t kBlock = 1024;

// Lists of indices, one after the other.
struct Lists {
  std::vector<uint32_t> offsets;
  std::vector<uint32_t> items;

  std::span<const uint32_t> Of(size_t i) const {
    return {items.data() + offsets[i], items.data() + offsets[i + 1]};
  }
  void End() { offsets.push_back(static_cast<uint32_t>(items.size())); }
};

Lists FacesOfVertices(const Triangles& triangles, size_t num_vertices) {
  Lists faces;
  faces.offsets.assign(num_vertices + 1, 0);
  for (const auto& triangle : triangles) {
    for (const uint32_t v : triangle) ++faces.offsets[v + 1];
  }
  for (size_t v = 0; v < num_vertices; ++v) faces.offsets[v + 1] += faces.offsets[v];
  faces.items.resize(3 * triangles.size());
  std::vector<uint32_t> next(faces.offsets.begin(), faces.offsets.end() - 1);
  for (size_t f = 0; f < triangles.size(); ++f) {
    for (const uint32_t v : triangles[f]) faces.items[next[v]++] = static_cast<uint32_t>(f);
  }
  return faces;
}

// Returns the faces that share a vertex with a face, itself included, ascending.
Lists NeighborsOfFaces(const Triangles& triangles, const Lists& faces_of_vertices) {
  Lists neighbors;
  neighbors.offsets.push_back(0);
  std::vector<uint32_t> around;
  for (const auto& triangle : triangles) {
    around.clear();
    for (const uint32_t v : triangle) {
      const auto faces = faces_of_vertices.Of(v);
      around.insert(around.end(), faces.begin(), faces.end());
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    neighbors.items.insert(neighbors.items.end(), around.begin(), around.end());
    neighbors.End();
  }
  return neighbors;
}

// Twice the area, along the normal.
Vector3d AreaVector(const std::vector<Vector3d>& x, const std::array<uint32_t, 3>& t) {
  return (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]);
}

Vector3d Centroid(const std::vector<Vector3d>& x, const std::array<uint32_t, 3>& t) {
  return (x[t[0]] + x[t[1]] + x[t[2]]) / 3;
}

// Zero where there is no direction.
Vector3d UnitOrZero(const Vector3d& v) {
  const double length = v.norm();
  return length > 0 ? Vector3d(v / length) : Vector3d::Zero();
}

class Smoother {
 public:
  Smoother(const Triangles& triangles, std::vector<Vector3d>* positions)
      : triangles_(triangles),
        x_(*positions),
        faces_of_vertices_(FacesOfVertices(triangles, positions->size())) {}

  // Every vertex half of the way to the mean of its neighbours.
  void Umbrella() {
    ForVertices([&](uint32_t v, std::span<const uint32_t> faces) -> Vector3d {
      return kUmbrellaStep * ToMeanOfNeighbors(x_, v, faces);
    });
  }

  // Towards the thin plate, by as much of the way as a vertex does not count there.
  void FairOutliers(const std::vector<double>& radii, const std::vector<VertexMove>& moves) {
    const std::vector<Vector3d> start = x_;
    std::vector<double> weights(x_.size(), 1);
    // Less than two divided by the largest eigenvalue of the distances and the bending.
    constexpr double kStep = 1.5 / (1 + 4 * kBending);
    for (int step = 0; step < kPlateSteps; ++step) {
      if (step >= kFirstWeights && step % kStepsOfWeights == 0) Weigh(start, radii, &weights);
      std::vector<Vector3d> bends(x_.size());
      ForFans([&](uint32_t v, std::span<const uint32_t> faces) {
        bends[v] = ToMeanOfNeighbors(x_, v, faces);
      });
      ForVertices([&](uint32_t v, std::span<const uint32_t> faces) -> Vector3d {
        if (moves[v] == VertexMove::kNone) return Vector3d::Zero();
        const Vector3d bending = ToMeanOfNeighbors(bends, v, faces);
        return kStep * (weights[v] * (start[v] - x_[v]) - kBending * bending);
      });
    }
    Weigh(start, radii, &weights);
    std::vector<double> means = weights, counts(x_.size(), 1);
    AddNeighbors(triangles_, 1, &means);
    AddNeighbors(triangles_, 1, &counts);
    std::vector<Vector3d> faired(x_.size());
    ForFans([&](uint32_t v, std::span<const uint32_t> faces) {
      const Vector3d move = x_[v] - start[v];
      const bool may_move = moves[v] != VertexMove::kOutwards || Normal(faces).dot(move) > 0;
      faired[v] = start[v];
      if (may_move) faired[v] += (1 - std::min(weights[v], means[v] / counts[v])) * move;
    });
    x_.swap(faired);
  }

  void FollowFilteredNormals() {
    const std::vector<Vector3d> normals = FilteredNormals();
    for (int step = 0; step < kVertexSteps; ++step) {
      ForVertices([&](uint32_t v, std::span<const uint32_t> faces) -> Vector3d {
        Vector3d sum = Vector3d::Zero();
        for (const uint32_t f : faces) {
          sum += normals[f] * normals[f].dot(Centroid(x_, triangles_[f]) - x_[v]);
        }
        return sum / static_cast<double>(faces.size());
      });
    }
  }

  // Along the normals, all by the same length, by which the enclosed volume comes closer to
  // `volume`: a step of Newton's method.
  void Grow(double volume) {
    // The derivative of the volume by a vertex is a third of the area of its faces, as a vector.
    std::vector<Vector3d> slopes(x_.size(), Vector3d::Zero());
    for (const auto& triangle : triangles_) {
      const Vector3d slope = AreaVector(x_, triangle) / 6;
      for (const uint32_t v : triangle) slopes[v] += slope;
    }
    double slope = 0;
    for (const Vector3d& of_vertex : slopes) slope += of_vertex.norm();
    if (!(slope > 0)) return;
    const double length = (volume - EnclosedVolume(x_, triangles_)) / slope;
    for (size_t v = 0; v < x_.size(); ++v) x_[v] += length * UnitOrZero(slopes[v]);
  }

 private:
  // Calls visit(v, its faces) for all vertices.
  template <typename Visit>
  void ForFans(const Visit& visit) const {
    ParallelForBlocks(static_cast<int64_t>(x_.size()), kBlock, [&](int64_t begin, int64_t end) {
      for (int64_t v = begin; v < end; ++v) {
        visit(static_cast<uint32_t>(v), faces_of_vertices_.Of(v));
      }
    });
  }

  // Moves all vertices at once, each by move(v, its faces).
  template <typename Move>
  void ForVertices(const Move& move) {
    std::vector<Vector3d> moved(x_.size());
    ForFans(
        [&](uint32_t v, std::span<const uint32_t> faces) { moved[v] = x_[v] + move(v, faces); });
    x_.swap(moved);
  }

  // The umbrella operator: from a vertex's value to the mean of its neighbours'.
  Vector3d ToMeanOfNeighbors(const std::vector<Vector3d>& values,
                             uint32_t v,
                             std::span<const uint32_t> faces) const {
    // In a closed fan every neighbour is in two faces.
    Vector3d sum = Vector3d::Zero();
    for (const uint32_t f : faces) {
      for (const uint32_t corner : triangles_[f]) sum += values[corner] - values[v];
    }
    return sum / (2 * static_cast<double>(faces.size()));
  }

  // Of a fan, out of the surface.
  Vector3d Normal(std::span<const uint32_t> faces) const {
    Vector3d area = Vector3d::Zero();
    for (const uint32_t f : faces) area += AreaVector(x_, triangles_[f]);
    return UnitOrZero(area);
  }

  // What vertices count by how far they have come from the start, along their normals.
  void Weigh(const std::vector<Vector3d>& start,
             const std::vector<double>& radii,
             std::vector<double>* weights) const {
    ForFans([&](uint32_t v, std::span<const uint32_t> faces) {
      const double distance = Normal(faces).dot(x_[v] - start[v]);
      const double length = kOutlierRadii * radii[v];
      const double share =
          distance != 0 ? length * length / (length * length + distance * distance) : 1;
      (*weights)[v] = share * share;
    });
  }

  std::vector<Vector3d> FilteredNormals() const {
    const size_t n = triangles_.size();
    const Lists neighbors = NeighborsOfFaces(triangles_, faces_of_vertices_);
    std::vector<Vector3d> normals(n), centroids(n);
    std::vector<double> areas(n);
    for (size_t f = 0; f < n; ++f) {
      const Vector3d area = AreaVector(x_, triangles_[f]);
      normals[f] = UnitOrZero(area);
      areas[f] = area.norm() / 2;
      centroids[f] = Centroid(x_, triangles_[f]);
    }
    double distance = 0;
    for (size_t f = 0; f < n; ++f) {
      for (const uint32_t g : neighbors.Of(f)) distance += (centroids[f] - centroids[g]).norm();
    }
    distance /= static_cast<double>(neighbors.items.size() - n);
    if (!(distance > 0)) return normals;

    const double nearness = -1 / (2 * distance * distance);
    const double likeness = -1 / (2 * kNormalSigma * kNormalSigma);
    std::vector<Vector3d> filtered(n);
    for (int step = 0; step < kNormalSteps; ++step) {
      ParallelForBlocks(static_cast<int64_t>(n), kBlock, [&](int64_t begin, int64_t end) {
        for (int64_t f = begin; f < end; ++f) {
          Vector3d sum = Vector3d::Zero();
          for (const uint32_t g : neighbors.Of(f)) {
            const double exponent = nearness * (centroids[f] - centroids[g]).squaredNorm() +
                                    likeness * (normals[f] - normals[g]).squaredNorm();
            sum += areas[g] * std::exp(exponent) * normals[g];
          }
          filtered[f] = UnitOrZero(sum);
        }
      });
      normals.swap(filtered);
    }
    return normals;
  }

  const Triangles& triangles_;
  std::vector<Vector3d>& x_;
  const Lists faces_of_vertices_;
};

}  // namespace

double EnclosedVolume(const std::vector<Vector3d>& positions, const Triangles& triangles) {
  if (positions.empty()) return 0;
  // From the first vertex, so that nothing is lost to a far offset.
  const Vector3d& origin = positions.front();
  double volume = 0;
  for (const auto& [a, b, c] : triangles) {
    volume += (positions[a] - origin).dot((positions[b] - origin).cross(positions[c] - origin)) / 6;
  }
  return volume;
}

void SmoothKeepingEdges(const Triangles& triangles,
                        const std::vector<double>& max_move,
                        double volume,
                        std::vector<Vector3d>* positions) {
  CHECK_EQ(max_move.size(), positions->size());
  if (triangles.empty()) return;
  const std::vector<Vector3d> start = *positions;
  const auto keep_near = [&] {
    for (size_t v = 0; v < start.size(); ++v) {
      const Vector3d move = (*positions)[v] - start[v];
      const double length = move.norm();
      if (length > max_move[v]) (*positions)[v] = start[v] + max_move[v] / length * move;
    }
  };
  Smoother smoother(triangles, positions);
  smoother.Umbrella();
  smoother.FollowFilteredNormals();
  for (int step = 0; step < kVolumeSteps; ++step) {
    keep_near();
    smoother.Grow(volume);
  }
  keep_near();
}

void FairOutliers(const Triangles& triangles,
                  const std::vector<double>& radii,
                  const std::vector<VertexMove>& moves,
                  std::vector<Vector3d>* positions) {
  CHECK_EQ(radii.size(), positions->size());
  CHECK_EQ(moves.size(), positions->size());
  Smoother(triangles, positions).FairOutliers(radii, moves);
}

void CutSpikes(const Triangles& triangles,
               const std::vector<uint8_t>& is_fixed,
               std::vector<Vector3d>* positions) {
  CHECK_EQ(is_fixed.size(), positions->size());
  std::vector<Vector3d>& x = *positions;
  for (int step = 0; step < kSpikeSteps; ++step) {
    // In a closed fan every neighbour is once the first of two.
    std::vector<Vector3d> sums(x.size(), Vector3d::Zero());
    std::vector<double> lengths(x.size(), 0), counts(x.size(), 0);
    for (const auto& triangle : triangles) {
      for (int k = 0; k < 3; ++k) {
        const uint32_t v = triangle[k], a = triangle[(k + 1) % 3], b = triangle[(k + 2) % 3];
        sums[v] += x[a];
        lengths[v] += (x[a] - x[b]).norm();
        ++counts[v];
      }
    }
    bool moved = false;
    for (size_t v = 0; v < x.size(); ++v) {
      if (is_fixed[v] || counts[v] == 0) continue;
      const Vector3d to_mean = sums[v] / counts[v] - x[v];
      if (!(to_mean.norm() > lengths[v] / (2 * std::numbers::pi))) continue;
      x[v] += kSpikeStep * to_mean;
      moved = true;
    }
    if (!moved) return;
  }
}

}  // namespace semfoam
