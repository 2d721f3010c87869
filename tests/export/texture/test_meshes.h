// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semfoam {

struct TestMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;

  double Area() const {
    double area = 0;
    for (const auto& [a, b, c] : triangles) {
      area += 0.5 * (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]).norm();
    }
    return area;
  }
};

// A closed surface over a grid that wraps around in both directions.
inline TestMesh ClosedGrid(int rows,
                           int columns,
                           const std::function<Eigen::Vector3d(double, double)>& place) {
  TestMesh mesh;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      mesh.vertices.push_back(
          place(2 * std::numbers::pi * i / rows, 2 * std::numbers::pi * j / columns));
    }
  }
  const auto at = [&](int i, int j) {
    return static_cast<uint32_t>(i % rows * columns + j % columns);
  };
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return mesh;
}

inline TestMesh Torus(double radius = 1, double tube = 0.4, int rows = 60, int columns = 30) {
  return ClosedGrid(rows, columns, [&](double u, double v) {
    const double r = radius + tube * std::cos(v);
    return Eigen::Vector3d(r * std::cos(u), r * std::sin(u), tube * std::sin(v));
  });
}

// A cube of edge 2 about the origin, each side of n x n squares, blown up to a sphere by
// `roundness` 1.
inline TestMesh Cube(int n, double roundness = 0) {
  TestMesh mesh;
  std::vector<std::array<int, 3>> keys;
  const auto vertex = [&](const std::array<int, 3>& key) {
    for (uint32_t v = 0; v < keys.size(); ++v) {
      if (keys[v] == key) return v;
    }
    keys.push_back(key);
    const Eigen::Vector3d x =
        Eigen::Vector3d(key[0], key[1], key[2]) * (2.0 / n) - Eigen::Vector3d::Ones();
    mesh.vertices.push_back((1 - roundness) * x + roundness * x.normalized());
    return static_cast<uint32_t>(keys.size() - 1);
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          const auto corner = [&](int di, int dj) {
            std::array<int, 3> key = {};
            key[axis] = side * n;
            key[(axis + 1) % 3] = i + di;
            key[(axis + 2) % 3] = j + dj;
            return vertex(key);
          };
          const uint32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
          if (side == 1) {
            mesh.triangles.push_back({a, b, c});
            mesh.triangles.push_back({a, c, d});
          } else {
            mesh.triangles.push_back({a, c, b});
            mesh.triangles.push_back({a, d, c});
          }
        }
      }
    }
  }
  return mesh;
}

}  // namespace semfoam
