// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/things_on_plane.h"

#include <algorithm>
#include <cmath>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr double kSquare = 0.05, kOnPlane = 0.02;
// Squares from the middle to the border, beyond which points belong to the surroundings.
constexpr int kRadius = 100;
// Fewest points of a square: single ones may be wrong.
constexpr int kFewestPoints = 2;
// Squares between points of one thing.
constexpr int kReach = 3;

double Cross(const Eigen::Vector2i& a, const Eigen::Vector2i& b, const Eigen::Vector2i& c) {
  const Eigen::Vector2d ab = (b - a).cast<double>(), ac = (c - a).cast<double>();
  return ab.x() * ac.y() - ab.y() * ac.x();
}

// Returns the corners of the convex hull, counterclockwise (Andrew 1979).
std::vector<Eigen::Vector2i> HullOf(std::vector<Eigen::Vector2i> points) {
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Eigen::Vector2i> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const size_t first = hull.size();
    for (const Eigen::Vector2i& point : points) {
      while (hull.size() >= first + 2 && Cross(hull[hull.size() - 2], hull.back(), point) <= 0) {
        hull.pop_back();
      }
      hull.push_back(point);
    }
    // The last corner is the first of the next pass.
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull.empty() ? points : hull;
}

}  // namespace

PointSpread SpreadOf(const std::vector<Eigen::Vector3f>& points) {
  CHECK(!points.empty());
  PointSpread spread;
  std::vector<double> values(points.size());
  const auto quantile = [&values](double share) {
    const auto at =
        values.begin() + static_cast<ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
    spread.middle[axis] = quantile(0.5);
  }
  for (size_t i = 0; i < points.size(); ++i) {
    values[i] = (points[i].cast<double>() - spread.middle).norm();
  }
  spread.radius = quantile(0.8);
  return spread;
}

ThingsOnPlane::ThingsOnPlane(const LevelPlane& plane, const std::vector<Eigen::Vector3f>& points) {
  const PointSpread spread = SpreadOf(points);
  middle_ = spread.middle;
  column_axis_ = plane.up.unitOrthogonal();
  row_axis_ = plane.up.cross(column_axis_);
  edge_ = std::max(kSquare * spread.radius, 1e-9);
  const int side = 2 * kRadius + 1;
  std::vector<int> counts(static_cast<size_t>(side) * side);
  const auto contains = [](const Square& square) {
    return square.cwiseAbs().maxCoeff() <= kRadius;
  };
  for (const Eigen::Vector3f& point : points) {
    const Eigen::Vector3d x = point.cast<double>();
    if (!(plane.HeightOf(x) > kOnPlane * spread.radius)) continue;
    const Eigen::Vector2d at = OnPlane(x) / edge_;
    if (!(at.cwiseAbs().maxCoeff() < kRadius)) continue;
    ++counts[IndexOf(
        {static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y()))})];
  }
  is_covered_.assign(counts.size(), 0);
  // Heaps are squares within reach of each other.
  std::vector<uint8_t> is_seen(counts.size(), 0);
  for (int row = -kRadius; row <= kRadius; ++row) {
    for (int column = -kRadius; column <= kRadius; ++column) {
      const auto is_new = [&](const Square& square) {
        return contains(square) && counts[IndexOf(square)] >= kFewestPoints &&
               is_seen[IndexOf(square)] == 0;
      };
      if (!is_new({column, row})) continue;
      std::vector<Square> heap = {{column, row}};
      is_seen[IndexOf(heap[0])] = 1;
      for (size_t k = 0; k < heap.size(); ++k) {
        const Square from = heap[k];
        for (int y = -kReach; y <= kReach; ++y) {
          for (int x = -kReach; x <= kReach; ++x) {
            const Square next = from + Square(x, y);
            if (!is_new(next)) continue;
            is_seen[IndexOf(next)] = 1;
            heap.push_back(next);
          }
        }
      }
      CoverHull(heap);
    }
  }
}

void ThingsOnPlane::CoverHull(const std::vector<Square>& squares) {
  const std::vector<Square> hull = HullOf(squares);
  Square low = squares[0], high = squares[0];
  for (const Square& square : squares) {
    low = low.cwiseMin(square);
    high = high.cwiseMax(square);
  }
  low = (low.array() - 1).max(-kRadius);
  high = (high.array() + 1).min(kRadius);
  for (int row = low.y(); row <= high.y(); ++row) {
    for (int column = low.x(); column <= high.x(); ++column) {
      // A square is covered if it, or one beside it, is within the hull.
      bool is_covered = false;
      for (int k = 0; k < 9 && !is_covered; ++k) {
        const Square at(column + k % 3 - 1, row + k / 3 - 1);
        is_covered = true;
        for (size_t i = 0; i < hull.size() && is_covered; ++i) {
          is_covered = Cross(hull[i], hull[(i + 1) % hull.size()], at) >= 0;
        }
        if (hull.size() < 3) {
          is_covered = std::find(squares.begin(), squares.end(), at) != squares.end();
        }
      }
      if (is_covered) is_covered_[IndexOf({column, row})] = 1;
    }
  }
}

bool ThingsOnPlane::IsUnderThing(const Eigen::Vector3d& x) const {
  const Eigen::Vector2d at = OnPlane(x) / edge_;
  if (!(at.cwiseAbs().maxCoeff() < kRadius)) return false;
  return is_covered_[IndexOf(
             {static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y()))})] != 0;
}

double ThingsOnPlane::DistanceFromMiddle(const Eigen::Vector3d& x) const {
  return OnPlane(x).norm();
}

Eigen::Vector2d ThingsOnPlane::OnPlane(const Eigen::Vector3d& x) const {
  return {column_axis_.dot(x - middle_), row_axis_.dot(x - middle_)};
}

size_t ThingsOnPlane::IndexOf(const Square& square) const {
  return static_cast<size_t>(square.y() + kRadius) * (2 * kRadius + 1) +
         static_cast<size_t>(square.x() + kRadius);
}

}  // namespace semfoam
