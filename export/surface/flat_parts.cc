// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/flat_parts.h"

#include "foam/geometry/plane_fit.h"
#include "foam/util/median.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include <Eigen/Dense>
#include <glog/logging.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;

// Steps of averaging of the normals over neighbours.
constexpr int kNormalSteps = 3;
// Directions among which the most frequent one of the normals is looked for, and attempts.
constexpr int kDirections = 500;
constexpr int kMostAttempts = 40;
// Degrees from such a direction: for its share, for the vertices of a plane and for its normal.
constexpr double kPeakDegrees = 15;
constexpr double kMemberDegrees = 30;
constexpr double kPlaneDegrees = 25;
// The tolerance in radii of cells.
constexpr double kToleranceRadii = 2;
constexpr size_t kFewestVertices = 40;
// Areas count up to that many times the median: huge triangles are where nothing is known.
constexpr double kMostArea = 1;
// Degrees between the normal of a vertex and that of a plane that it moves into.
constexpr double kFlattenDegrees = 30;
// Two planes meet in a line where the sine of their angle is at least this.
constexpr double kLeastSine = 0.5;

double Cosine(double degrees) { return std::cos(degrees * std::numbers::pi / 180); }

std::vector<Vector3d> SmoothNormals(const Triangles& triangles,
                                    const std::vector<Vector3d>& positions,
                                    std::vector<double>* areas) {
  std::vector<Vector3d> normals(positions.size(), Vector3d::Zero());
  areas->assign(positions.size(), 0);
  for (const auto& triangle : triangles) {
    const auto& [a, b, c] = triangle;
    const Vector3d area = (positions[b] - positions[a]).cross(positions[c] - positions[a]) / 2;
    for (const uint32_t v : triangle) {
      normals[v] += area;
      (*areas)[v] += area.norm() / 3;
    }
  }
  AddNeighbors(triangles, kNormalSteps, &normals);
  for (Vector3d& normal : normals) normal = normal.stableNormalized();
  return normals;
}

// Directions evenly over the sphere (Fibonacci's lattice).
std::vector<Vector3d> Directions() {
  std::vector<Vector3d> directions;
  for (int k = 0; k < kDirections; ++k) {
    const double z = 1 - (2 * k + 1.0) / kDirections;
    const double angle = 2 * std::numbers::pi * k / std::numbers::phi;
    const double radius = std::sqrt(1 - z * z);
    directions.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
  return directions;
}

// Share of the squared distances from a plane that a polynomial of fourth order explains.
double ExplainedByCurvature(const PlaneFit& fit,
                            const std::vector<Vector3d>& points,
                            const std::vector<double>& weights) {
  const Vector3d u = fit.normal.unitOrthogonal(), v = fit.normal.cross(u);
  double scale = 0;
  for (const Vector3d& x : points) scale = std::max(scale, (x - fit.point).norm());
  using Row = Eigen::Matrix<double, 15, 1>;
  Eigen::Matrix<double, 15, 15> normal_matrix = Eigen::Matrix<double, 15, 15>::Zero();
  Row right = Row::Zero();
  double squares = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const Vector3d x = (points[i] - fit.point) / scale;
    const double a = u.dot(x), b = v.dot(x), h = fit.normal.dot(x);
    Row row;
    int k = 0;
    double of_a = 1;
    for (int i = 0; i <= 4; ++i, of_a *= a) {
      double both = of_a;
      for (int j = 0; i + j <= 4; ++j, both *= b) row[k++] = both;
    }
    normal_matrix += weights[i] * row * row.transpose();
    right += weights[i] * h * row;
    squares += weights[i] * h * h;
  }
  if (!(squares > 0)) return 0;
  const Row coefficients = normal_matrix.ldlt().solve(right);
  return coefficients.dot(right) / squares;
}

}  // namespace

std::vector<FlatPart> FindFlatParts(const SurfaceInPhotos& surface) {
  const size_t n = surface.positions.size();
  CHECK_EQ(surface.shown.size(), n);
  CHECK_EQ(surface.radii.size(), n);
  std::vector<double> areas;
  const std::vector<Vector3d> normals = SmoothNormals(surface.triangles, surface.positions, &areas);
  std::vector<uint32_t> remaining;
  std::vector<double> shown_areas;
  for (uint32_t v = 0; v < n; ++v) {
    if (!surface.shown[v] || !(areas[v] > 0)) continue;
    remaining.push_back(v);
    shown_areas.push_back(areas[v]);
  }
  std::vector<FlatPart> parts;
  if (remaining.size() < kFewestVertices) return parts;
  const double most_area = kMostArea * Median(shown_areas);
  double total = 0;
  for (const uint32_t v : remaining) {
    areas[v] = std::min(areas[v], most_area);
    total += areas[v];
  }
  const auto area_of = [&](const std::vector<uint32_t>& vertices) {
    double sum = 0;
    for (const uint32_t v : vertices) sum += areas[v];
    return sum;
  };
  const std::vector<Vector3d> directions = Directions();
  const double peak_cosine = Cosine(kPeakDegrees), member_cosine = Cosine(kMemberDegrees);
  for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
    std::vector<double> peaks(directions.size(), 0);
    for (const uint32_t v : remaining) {
      for (size_t k = 0; k < directions.size(); ++k) {
        if (normals[v].dot(directions[k]) > peak_cosine) peaks[k] += areas[v];
      }
    }
    const size_t peak = std::max_element(peaks.begin(), peaks.end()) - peaks.begin();
    if (peaks[peak] < kLeastFlatShare * total) break;
    const Vector3d& direction = directions[peak];
    SurfaceSamples samples;
    std::vector<uint32_t> members;
    std::vector<double> radii;
    for (const uint32_t v : remaining) {
      if (!(normals[v].dot(direction) > member_cosine)) continue;
      members.push_back(v);
      samples.points.push_back(surface.positions[v]);
      samples.weights.push_back(areas[v]);
      radii.push_back(surface.radii[v]);
    }
    samples.tolerance = kToleranceRadii * Median(radii);
    const std::optional<PlaneFit> fit = FitPlane(samples, NormalLimit{direction, kPlaneDegrees});
    std::vector<uint32_t> inliers;
    std::vector<Vector3d> points;
    std::vector<double> weights;
    for (const uint32_t v : members) {
      if (!fit ||
          !(std::abs(fit->normal.dot(surface.positions[v] - fit->point)) < samples.tolerance)) {
        continue;
      }
      inliers.push_back(v);
      points.push_back(surface.positions[v]);
      weights.push_back(areas[v]);
    }
    const double area = area_of(inliers);
    const bool is_large = inliers.size() >= kFewestVertices && area >= kLeastFlatShare * total &&
                          area >= kLeastFlatOfDirection * area_of(members);
    if (is_large && ExplainedByCurvature(*fit, points, weights) < kMostCurved) {
      const Vector3d normal = fit->normal.dot(direction) < 0 ? -fit->normal : fit->normal;
      parts.push_back({Eigen::Hyperplane<double, 3>(normal, fit->point), samples.tolerance});
    }
    // What was looked at is not looked at again: the plane's vertices, or all of the direction.
    std::vector<uint32_t> rest;
    for (const uint32_t v : remaining) {
      const bool is_done = is_large ? std::binary_search(inliers.begin(), inliers.end(), v)
                                    : normals[v].dot(direction) > peak_cosine;
      if (!is_done) rest.push_back(v);
    }
    remaining = std::move(rest);
    if (remaining.size() < kFewestVertices) break;
  }
  return parts;
}

std::vector<uint8_t> Flatten(const std::vector<FlatPart>& parts,
                             const Triangles& triangles,
                             const std::vector<double>& radii,
                             const std::vector<uint8_t>& is_fixed,
                             std::vector<Vector3d>* positions) {
  CHECK_EQ(is_fixed.size(), positions->size());
  std::vector<uint8_t> is_flat(positions->size(), 0);
  if (parts.empty()) return is_flat;
  std::vector<double> areas;
  const std::vector<Vector3d> normals = SmoothNormals(triangles, *positions, &areas);
  struct Move {
    Vector3d normal;
    double by;
    double distance;  // as a share of the tolerance
  };
  for (size_t v = 0; v < positions->size(); ++v) {
    std::vector<Move> moves;
    for (const FlatPart& part : parts) {
      const double distance = part.plane.signedDistance((*positions)[v]);
      const double share =
          std::abs(distance) / std::max(part.tolerance, kToleranceRadii * radii[v]);
      if (share >= 1 || normals[v].dot(part.plane.normal()) < Cosine(kFlattenDegrees)) continue;
      moves.push_back({part.plane.normal(), -distance * std::min(1.0, 2 - 2 * share), share});
    }
    is_flat[v] = !moves.empty();
    if (moves.empty() || is_fixed[v]) continue;
    std::stable_sort(moves.begin(), moves.end(), [](const Move& a, const Move& b) {
      return a.distance < b.distance;
    });
    const Move& first = moves[0];
    Vector3d by = first.by * first.normal;
    for (size_t k = 1; k < moves.size(); ++k) {
      const Vector3d across = moves[k].normal - moves[k].normal.dot(first.normal) * first.normal;
      if (across.norm() < kLeastSine) continue;
      // Within the first plane, until the second is met.
      by += (moves[k].by - moves[k].normal.dot(by)) / across.squaredNorm() * across;
      break;
    }
    (*positions)[v] += by;
  }
  return is_flat;
}

}  // namespace semfoam
