// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/surface_geometry.h"

#include "foam/util/parallel.h"

#include <cmath>

#include "tests/export/surface/surface_checks.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;
using ::testing::IsEmpty;

ObjectSurface Moved(ObjectSurface surface, double scale, const Vector3d& offset) {
  for (Vector3d& x : surface.vertices) x = scale * x + offset;
  return surface;
}

// Both in one mesh.
ObjectSurface Together(ObjectSurface a, const ObjectSurface& b) {
  const uint32_t first = static_cast<uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& [i, j, k] : b.triangles) {
    a.triangles.push_back({first + i, first + j, first + k});
  }
  return a;
}

TEST(SurfaceGeometry, DistancesAreThoseOfTheSurfaces) {
  const ObjectSurface box = BoxSurface(6);
  // A box within a box: every point of the inner one is 0.25 from the outer one; the corners of the
  // outer one are farthest from the inner one.
  const ObjectSurface inner = Moved(box, 0.75, Vector3d::Zero());
  const SurfaceDistance in_out =
      DistanceTo(inner.vertices, inner.triangles, box.vertices, box.triangles);
  EXPECT_NEAR(in_out.mean, 0.25, 1e-12);
  EXPECT_NEAR(in_out.max, 0.25, 1e-12);
  const SurfaceDistance out_in =
      DistanceTo(box.vertices, box.triangles, inner.vertices, inner.triangles);
  EXPECT_NEAR(out_in.max, 0.25 * std::sqrt(3.0), 1e-12);
  EXPECT_GT(out_in.mean, 0.25);
  EXPECT_LT(out_in.mean, 0.28);
  const SurfaceDistance none = DistanceTo(box.vertices, box.triangles, box.vertices, box.triangles);
  EXPECT_LT(none.max, 1e-12);
}

TEST(SurfaceGeometry, TheMeanIsOverTheAreaWhateverTheTriangles) {
  // The bottom in many triangles, the rest in few: the same mean as with equal ones, against a box
  // moved along an axis, whose distances differ from side to side.
  ObjectSurface fine = BoxSurface(40);
  ObjectSurface coarse = BoxSurface(1);
  const ObjectSurface other = Moved(coarse, 1, {0.3, 0, 0});
  const auto mean = [&](const ObjectSurface& from) {
    return DistanceTo(from.vertices, from.triangles, other.vertices, other.triangles).mean;
  };
  EXPECT_NEAR(mean(fine), mean(coarse), 1e-3);
  // The side that stands out is 0.3 away; the one inside 0.3 or what its rim is nearer than that;
  // of the four others, the strip that stands out is 0.15 away in the mean, the rest lies on the
  // other.
  const double inside = (1 - 0.7 * 0.7 * 0.7) / 3;
  EXPECT_NEAR(mean(coarse), (0.3 + inside + 4 * 0.15 * 0.15) / 6, 1e-3);
}

TEST(SurfaceGeometry, TheSameOnAnyNumberOfThreads) {
  const ObjectSurface a = BoxSurface(9), b = Moved(a, 0.9, {0.01, 0.02, 0.03});
  std::vector<SurfaceDistance> results;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    results.push_back(DistanceTo(a.vertices, a.triangles, b.vertices, b.triangles));
  }
  for (const SurfaceDistance& result : results) {
    EXPECT_EQ(result.mean, results[0].mean);
    EXPECT_EQ(result.max, results[0].max);
  }
}

TEST(SurfaceGeometry, SelfIntersectionsAreFound) {
  const ObjectSurface box = BoxSurface(4);
  EXPECT_THAT(SelfIntersections(box.vertices, box.triangles), IsEmpty());
  const ObjectSurface apart = Together(box, Moved(box, 1, {2.5, 0.1, 0.1}));
  EXPECT_THAT(SelfIntersections(apart.vertices, apart.triangles), IsEmpty());
  const ObjectSurface crossing = Together(box, Moved(box, 1, {1.9, 0.1, 0.1}));
  const std::vector<uint32_t> faces = SelfIntersections(crossing.vertices, crossing.triangles);
  EXPECT_GT(faces.size(), 10u);
  EXPECT_TRUE(std::is_sorted(faces.begin(), faces.end()));
  // They are near x = 0.9 .. 1, no others.
  for (const uint32_t f : faces) {
    double least = 10, most = -10;
    for (const uint32_t v : crossing.triangles[f]) {
      least = std::min(least, crossing.vertices[v].x());
      most = std::max(most, crossing.vertices[v].x());
    }
    EXPECT_LE(least, 1 + 1e-9);
    EXPECT_GE(most, 0.9 - 1e-9);
  }
  // A vertex pushed through the opposite side.
  ObjectSurface folded = box;
  folded.vertices[folded.triangles[0][2]] = {3, 0.03, 0.07};
  EXPECT_GT(SelfIntersections(folded.vertices, folded.triangles).size(), 2u);
}

}  // namespace
}  // namespace semfoam
