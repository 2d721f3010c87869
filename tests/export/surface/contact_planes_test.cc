// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/contact_planes.h"

#include "export/scene/object_surface.h"
#include "export/surface/smooth_surface.h"
#include "export/surface/surface_geometry.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "tests/export/surface/surface_checks.h"
#include "tests/export/test_foams.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr float kTop = -0.2f;

// A mug on a table whose top is at z = kTop, and photos that show the air and what borders on it.
// Below the mug lies what `below` says: 0, the mug's; 1, the table's; kAir.
Model MugOnTable(
    const std::function<int(const Vector3f&)>& below,
    const std::function<float(const Vector3f&)>& top = [](auto) { return kTop; }) {
  const auto class_of = [=](const Vector3f& p) {
    if (p.head<2>().norm() < 0.3f && p.z() < 0.3f) {
      if (p.z() > kTop) return 0;
      if (p.z() > kTop - 0.2f) return below(p);
    }
    return p.z() < top(p) && p.z() > -0.6f ? 1 : kAir;
  };
  Model model = MakeModel(GridSites(20, 0.08f, 0.1f, 5), 2, class_of);
  model.labels[1].name = "table";
  CellStatistics& statistics = model.statistics;
  statistics.contribution.clear();
  for (const Vector3f& p : model.foam.positions) {
    const bool is_air = class_of(p) == kAir && p.z() > top(p);
    const bool is_hidden = p.head<2>().norm() < 0.3f && p.z() < kTop + 0.05f;
    const bool is_at_air = !is_air && !is_hidden;
    statistics.passed.push_back(is_air ? 100.f : 0.f);
    statistics.stopped.push_back(is_at_air ? 100.f : 0.f);
    statistics.contribution.push_back(is_at_air ? 1.f : 0.f);
  }
  return model;
}

int MugBelow(const Vector3f&) { return 0; }

ObjectSurface SurfaceWithContacts(const ExportableScene& scene) {
  ObjectInfo object = scene.objects[0];
  const auto contacts = ContactPlanes(scene, object);
  object.cells = CellsUpToContacts(scene, contacts, object.cells);
  return ExtractSmoothSurface(scene, object, ExtractSurface(scene, object), WholeSpace(), contacts);
}

TEST(ContactPlanes, AMugThatReachesIntoTheTableEndsInItsTop) {
  const ExportableScene scene = MakeExportableScene(MugOnTable(MugBelow));
  ASSERT_EQ(scene.objects[0].name, "mug");
  const auto contacts = ContactPlanes(scene, scene.objects[0]);
  ASSERT_THAT(contacts, SizeIs(1));
  EXPECT_LT(contacts[0].plane.normal().z(), -0.99);
  EXPECT_LT(contacts[0].plane.absDistance(Vector3d(0, 0, kTop)), 0.04);

  const ObjectSurface surface = SurfaceWithContacts(scene);
  ExpectClosedManifold(surface);
  EXPECT_THAT(SelfIntersections(surface.vertices, surface.triangles), IsEmpty());
  int at_plane = 0;
  for (const Vector3d& x : surface.vertices) {
    EXPECT_LT(contacts[0].plane.signedDistance(x), 0.01);
    at_plane += contacts[0].plane.absDistance(x) < 1e-6;
  }
  EXPECT_GT(at_plane, 30);
  // Without the plane it reaches down to where its cells do.
  const ObjectSurface ragged =
      ExtractSmoothSurface(scene, scene.objects[0], ExtractSurface(scene, scene.objects[0]));
  double lowest = 0;
  for (const Vector3d& x : ragged.vertices) lowest = std::min(lowest, x.z());
  EXPECT_LT(lowest, kTop - 0.1);
}

TEST(ContactPlanes, TheLineInThePlaneIsSmoothAndBelowWhatStandsOnIt) {
  const ExportableScene scene = MakeExportableScene(MugOnTable(MugBelow));
  const auto contacts = ContactPlanes(scene, scene.objects[0]);
  ASSERT_THAT(contacts, SizeIs(1));
  const ObjectSurface surface = SurfaceWithContacts(scene);
  // Distances from the axis of what is in the plane and borders on what is above it.
  const auto is_above = [&](uint32_t v) { return !surface.vertex_in_contact[v]; };
  std::set<uint32_t> line;
  for (const auto& triangle : surface.triangles) {
    if (!std::any_of(triangle.begin(), triangle.end(), is_above)) continue;
    for (const uint32_t v : triangle) {
      if (!is_above(v)) line.insert(v);
    }
  }
  ASSERT_GT(line.size(), 20u);
  double sum = 0, squares = 0;
  for (const uint32_t v : line) {
    const double radius = surface.vertices[v].head<2>().norm();
    sum += radius;
    squares += radius * radius;
  }
  const double mean = sum / static_cast<double>(line.size());
  // The mug's radius is 0.3, that of its cells 0.05.
  EXPECT_NEAR(mean, 0.3, 0.03);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(line.size()) - mean * mean), 0.015);
}

TEST(ContactPlanes, GapsAboveTheTableAreFilled) {
  // Air of no object in a hollow below the mug, above the plane.
  Model model = MugOnTable([](const Vector3f&) { return 1; });
  const ExportableScene scene = MakeExportableScene(model);
  const ObjectInfo& mug = scene.objects[0];
  const auto contacts = ContactPlanes(scene, mug);
  ASSERT_THAT(contacts, SizeIs(1));
  std::vector<uint32_t> with_gap;
  uint32_t gap = 0;
  for (const uint32_t cell : mug.cells) {
    const Vector3f& p = scene.cell_positions[cell];
    if (p.head<2>().norm() < 0.08f && p.z() < kTop + 0.09f && gap == 0) {
      gap = cell;
    } else {
      with_gap.push_back(cell);
    }
  }
  ASSERT_NE(gap, 0u);
  ExportableScene open = scene;
  open.object_of_cell[gap] = -1;
  const auto filled = CellsUpToContacts(open, contacts, with_gap);
  EXPECT_TRUE(std::binary_search(filled.begin(), filled.end(), gap));
  // Not what photos look through.
  open.crossed[gap] = 1;
  const auto seen = CellsUpToContacts(open, contacts, with_gap);
  EXPECT_FALSE(std::binary_search(seen.begin(), seen.end(), gap));
}

TEST(ContactPlanes, ThereIsNoneOnWhatIsNotFlatOrNotKnown) {
  const ExportableScene waves = MakeExportableScene(MugOnTable(
      MugBelow, [](const Vector3f& p) { return kTop - 0.25f + 0.25f * std::sin(9 * p.x()); }));
  EXPECT_THAT(ContactPlanes(waves, waves.objects[0]), IsEmpty());
  Model model = MugOnTable(MugBelow);
  model.statistics.passed.clear();
  model.statistics.stopped.clear();
  const ExportableScene unknown = MakeExportableScene(model);
  EXPECT_THAT(ContactPlanes(unknown, unknown.objects[0]), IsEmpty());
  EXPECT_EQ(CellsUpToContacts(unknown, {}, unknown.objects[0].cells), unknown.objects[0].cells);
}

TEST(ContactPlanes, NothingIsCutWherePhotosShowItBeyond) {
  // The table does not end at the mug's side, wherever a plane may fit.
  const ExportableScene scene = MakeExportableScene(MugOnTable(MugBelow));
  ASSERT_EQ(scene.objects[1].name, "table");
  EXPECT_THAT(ContactPlanes(scene, scene.objects[1]), IsEmpty());
}

TEST(ContactPlanes, TheSameOnAnyNumberOfThreads) {
  std::vector<ObjectSurface> surfaces;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    surfaces.push_back(SurfaceWithContacts(MakeExportableScene(MugOnTable(MugBelow))));
    EXPECT_EQ(surfaces.back().vertices, surfaces[0].vertices);
    EXPECT_EQ(surfaces.back().triangles, surfaces[0].triangles);
  }
}

}  // namespace
}  // namespace semfoam
