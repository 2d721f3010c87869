// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/object_surface.h"

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace semfoam {

// Every side of a triangle lies in exactly one triangle per direction, and the triangles around
// every vertex form one single fan.
inline void ExpectClosedManifold(const ObjectSurface& surface) {
  std::map<std::pair<uint32_t, uint32_t>, int> sides;
  std::vector<std::map<uint32_t, uint32_t>> fans(surface.vertices.size());
  for (const auto& t : surface.triangles) {
    for (int k = 0; k < 3; ++k) {
      const uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
      ASSERT_NE(a, b);
      ASSERT_LT(a, surface.vertices.size());
      ++sides[{a, b}];
      fans[a][b] = c;
    }
  }
  int wrong = 0;
  for (const auto& [side, count] : sides) {
    const auto opposite = sides.find({side.second, side.first});
    if (count != 1 || opposite == sides.end() || opposite->second != 1) ++wrong;
  }
  EXPECT_EQ(wrong, 0) << "sides without their one opposite";
  for (const auto& fan : fans) {
    ASSERT_FALSE(fan.empty()) << "a vertex without triangle";
    size_t length = 0;
    uint32_t at = fan.begin()->first;
    do {
      ASSERT_TRUE(fan.count(at));
      at = fan.at(at);
      ++length;
    } while (at != fan.begin()->first && length <= fan.size());
    EXPECT_EQ(length, fan.size()) << "two fans meet in one vertex";
  }
}

inline double EnclosedVolume(const ObjectSurface& surface) {
  const Eigen::Vector3d origin = surface.vertices.front();
  double volume = 0;
  for (const auto& t : surface.triangles) {
    volume += (surface.vertices[t[0]] - origin)
                  .dot((surface.vertices[t[1]] - origin).cross(surface.vertices[t[2]] - origin)) /
              6;
  }
  return volume;
}

inline int EulerCharacteristic(const ObjectSurface& surface) {
  return static_cast<int>(surface.vertices.size()) -
         static_cast<int>(surface.triangles.size() * 3 / 2) +
         static_cast<int>(surface.triangles.size());
}

// The surface of the box [-1, 1]^3 in squares of 2 / n, each cut in two: 12 n^2 triangles.
inline ObjectSurface BoxSurface(int n) {
  ObjectSurface surface;
  surface.object_id = LabelId{7};
  surface.object_name = "mug";
  std::map<std::array<int, 3>, uint32_t> index;
  const auto vertex = [&](int axis, int side, int u, int v) {
    std::array<int, 3> at;
    at[axis] = side * n;
    at[(axis + 1) % 3] = u;
    at[(axis + 2) % 3] = v;
    const auto [entry, is_new] = index.emplace(at, surface.vertices.size());
    if (is_new) {
      surface.vertices.push_back(2.0 / n * Eigen::Vector3d(at[0], at[1], at[2]) -
                                 Eigen::Vector3d::Ones());
    }
    return entry->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      for (int u = 0; u < n; ++u) {
        for (int v = 0; v < n; ++v) {
          const uint32_t a = vertex(axis, side, u, v), b = vertex(axis, side, u + 1, v),
                         c = vertex(axis, side, u + 1, v + 1), d = vertex(axis, side, u, v + 1);
          if (side == 1) {
            surface.triangles.push_back({a, b, c});
            surface.triangles.push_back({a, c, d});
          } else {
            surface.triangles.push_back({a, c, b});
            surface.triangles.push_back({a, d, c});
          }
        }
      }
    }
  }
  for (size_t v = 0; v < surface.vertices.size(); ++v) {
    surface.vertex_color.push_back(
        {static_cast<uint8_t>(v % 256), static_cast<uint8_t>(v / 256), 9});
    surface.vertex_confidence.push_back(static_cast<float>(v) / 1e4f);
  }
  ShowVerticesOnFaces(&surface);
  return surface;
}

}  // namespace semfoam
