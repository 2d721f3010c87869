// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/open_sheet.h"

#include "export/io/surface_export.h"
#include "export/scene/whole_scene.h"
#include "export/surface/smooth_surface.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <utility>

#include "tests/export/surface/surface_checks.h"
#include "tests/export/test_foams.h"
#include "tests/temp_folder.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using ::testing::Not;

// Every side lies in at most one triangle per direction, and the triangles around a vertex are one
// fan, whose ends are at the rim or meet.
void ExpectManifoldWithRim(const ObjectSurface& sheet) {
  std::map<std::pair<uint32_t, uint32_t>, int> sides;
  std::vector<std::map<uint32_t, uint32_t>> fans(sheet.vertices.size());
  for (const auto& t : sheet.triangles) {
    for (int k = 0; k < 3; ++k) {
      ASSERT_LT(t[k], sheet.vertices.size());
      EXPECT_EQ((++sides[{t[k], t[(k + 1) % 3]}]), 1);
      fans[t[k]][t[(k + 1) % 3]] = t[(k + 2) % 3];
    }
  }
  for (const auto& fan : fans) {
    ASSERT_FALSE(fan.empty()) << "a vertex without triangle";
    // From where no other triangle leads to, if there is such a place.
    uint32_t first = fan.begin()->first;
    for (const auto& [from, to] : fan) {
      const bool is_reached = std::any_of(
          fan.begin(), fan.end(), [&, from = from](const auto& f) { return f.second == from; });
      if (!is_reached) first = from;
    }
    size_t length = 0;
    for (uint32_t at = first; fan.count(at) && length < fan.size(); at = fan.at(at)) ++length;
    EXPECT_EQ(length, fan.size()) << "two fans meet in one vertex";
  }
}

ObjectSurface Box(int n, const std::function<bool(const Vector3d&)>& is_shown) {
  ObjectSurface box = BoxSurface(n);
  for (const Vector3d& x : box.vertices) box.vertex_shown.push_back(is_shown(x));
  box.vertex_in_contact.assign(box.vertices.size(), 0);
  box.vertex_flat.assign(box.vertices.size(), 0);
  return box;
}

TEST(OpenSheet, KeepsTheShownSideOfABox) {
  const ObjectSurface box = Box(8, [](const Vector3d& x) { return x.z() > 0.99; });
  const ObjectSurface sheet = OpenSheet(box);
  ExpectManifoldWithRim(sheet);
  EXPECT_EQ(sheet.object_name, box.object_name);
  EXPECT_EQ(TopologyOfSheet(sheet).pieces, 1);
  EXPECT_EQ(TopologyOfSheet(sheet).rims, 1);
  double area = 0;
  for (const auto& [a, b, c] : sheet.triangles) {
    const Vector3d normal =
        (sheet.vertices[b] - sheet.vertices[a]).cross(sheet.vertices[c] - sheet.vertices[a]);
    if (sheet.vertices[a].z() > 0.99 && sheet.vertices[b].z() > 0.99 &&
        sheet.vertices[c].z() > 0.99) {
      EXPECT_GT(normal.z(), 0);
      area += normal.norm() / 2;
    }
  }
  EXPECT_NEAR(area, 4, 1e-9);
  EXPECT_EQ(sheet.face_color.size(), sheet.triangles.size());
  EXPECT_EQ(sheet.vertex_color.size(), sheet.vertices.size());
  // What is shown all around has no rim.
  const ObjectSurface closed = OpenSheet(Box(8, [](const Vector3d&) { return true; }));
  EXPECT_EQ(closed.triangles.size(), box.triangles.size());
  EXPECT_EQ(TopologyOfSheet(closed).rims, 0);
  EXPECT_TRUE(OpenSheet(Box(8, [](const Vector3d&) { return false; })).triangles.empty());
}

TEST(OpenSheet, ClosesSmallHolesAndDropsSmallPieces) {
  const auto near = [](const Vector3d& x, const Vector3d& y) { return (x - y).norm() < 0.045; };
  const ObjectSurface sheet = OpenSheet(Box(40, [&](const Vector3d& x) {
    return (x.z() > 0.99 && !near(x, {0, 0, 1})) || near(x, {0, 0, -1});
  }));
  EXPECT_EQ(TopologyOfSheet(sheet).pieces, 1);
  EXPECT_EQ(TopologyOfSheet(sheet).rims, 1);
  // A large hole stays, and so does a large piece.
  const ObjectSurface holed = OpenSheet(Box(
      40, [&](const Vector3d& x) { return std::abs(x.z()) > 0.99 && x.head<2>().norm() > 0.3; }));
  ExpectManifoldWithRim(holed);
  EXPECT_EQ(TopologyOfSheet(holed).pieces, 2);
  EXPECT_EQ(TopologyOfSheet(holed).rims, 4);
}

TEST(OpenSheet, PiecesThatTouchInAVertexGetOneEach) {
  // Of a row of three vertices only the faces at its two sides have two.
  const ObjectSurface sheet = OpenSheet(Box(4, [](const Vector3d& x) {
    return x.z() > 0.99 && std::abs(x.y()) < 0.1 && std::abs(x.x()) < 0.6;
  }));
  EXPECT_EQ(sheet.triangles.size(), 4u);
  ExpectManifoldWithRim(sheet);
  EXPECT_EQ(TopologyOfSheet(sheet).pieces, 2);
}

TEST(OpenSheet, LongTrianglesAtTheRimGo) {
  ObjectSurface box = Box(16, [](const Vector3d& x) { return x.z() > 0.99; });
  const double before = OpenSheet(box).triangles.size();
  // One corner of the top is drawn out far.
  for (Vector3d& x : box.vertices) {
    if ((x - Vector3d(1, 1, 1)).norm() < 1e-9) x = {9, 9, 1};
  }
  const ObjectSurface sheet = OpenSheet(box);
  EXPECT_LT(sheet.triangles.size(), before);
  EXPECT_GT(sheet.triangles.size(), before - 8);
  for (const Vector3d& x : sheet.vertices) EXPECT_LT(x.norm(), 2);
}

TEST(OpenSheet, PlanesGoOnWhereNoPhotoShowsThem) {
  ObjectSurface box =
      Box(8, [](const Vector3d& x) { return x.z() > 0.99 && x.head<2>().norm() > 0.6; });
  EXPECT_EQ(TopologyOfSheet(OpenSheet(box)).rims, 2);
  for (size_t v = 0; v < box.vertices.size(); ++v) box.vertex_flat[v] = box.vertices[v].z() > 0.99;
  EXPECT_EQ(TopologyOfSheet(OpenSheet(box)).rims, 1);
}

TEST(IsSheet, TellsWallsFromBodies) {
  const auto is_on_top = [](const Vector3d& x) { return x.z() > 0.99; };
  ObjectSurface box = Box(8, is_on_top);
  // Photographed from above only: a body, unless it is flat there, or goes on beyond the photos.
  EXPECT_FALSE(IsSheet(box, false));
  EXPECT_TRUE(IsSheet(box, true));
  for (size_t v = 0; v < box.vertices.size(); ++v) box.vertex_flat[v] = is_on_top(box.vertices[v]);
  EXPECT_TRUE(IsSheet(box, false));
  // The same box on a table, seen but for what it stands on.
  ObjectSurface standing = Box(8, [](const Vector3d& x) { return x.z() > -0.99; });
  EXPECT_FALSE(IsSheet(standing, true));
  // A thin book, of which the table hides half of the area.
  for (Vector3d& x : box.vertices) x.z() *= 0.01;
  EXPECT_TRUE(IsSheet(box, false));
  for (size_t v = 0; v < box.vertices.size(); ++v) {
    box.vertex_in_contact[v] = box.vertices[v].z() < -0.0099;
  }
  EXPECT_FALSE(IsSheet(box, false));
  // Nothing is known of what photos show.
  EXPECT_FALSE(IsSheet(Box(8, [](const Vector3d&) { return false; }), true));
}

// Matter on a grid, at whose upper side photos look from above.
Model SeenFromAbove(const std::function<bool(const Eigen::Vector3f&)>& is_matter) {
  Model model = MakeModel(GridSites(12, 0.1f, 0.2f, 5), 1, [&](const Eigen::Vector3f& p) {
    return is_matter(p) ? 0 : kAir;
  });
  CellStatistics& statistics = model.statistics;
  statistics.contribution.clear();
  for (const Eigen::Vector3f& p : model.foam.positions) {
    const bool is_above = !is_matter(p) && p.z() > 0;
    statistics.passed.push_back(is_above ? 100.f : 0.f);
    statistics.stopped.push_back(is_matter(p) && p.z() > 0 ? 100.f : 0.f);
  }
  return model;
}

Model Slab() {
  return SeenFromAbove([](const Eigen::Vector3f& p) {
    return std::abs(p.z()) < 0.15f && p.head<2>().norm() < 0.5f;
  });
}

Model BallFromAbove() {
  return SeenFromAbove([](const Eigen::Vector3f& p) { return p.norm() < 0.45f; });
}

TEST(OpenSheet, ScenesAreExportedAsSheetsUnlessTheyAreToBeClosed) {
  const TempFolder folder;
  SurfaceExportOptions options;
  const ExportableScene labelled = MakeExportableScene(Slab());
  EXPECT_THAT(ExportSurfaces(labelled, folder.path(), options)[0].summary,
              HasSubstr("a sheet of 1 piece, 1 rim"));
  // A ball is a body, though photos look at its upper half only.
  EXPECT_THAT(
      ExportSurfaces(MakeExportableScene(BallFromAbove()), folder.path(), options)[0].summary,
      HasSubstr("1 shell, no cavities, genus 0"));
  const ExportableScene scene = MakeWholeScene(Slab());
  EXPECT_THAT(ExportWholeSurface(scene, folder.path(), options)[0].summary,
              HasSubstr("a sheet of 1 piece, 1 rim"));
  options.close_sheets = true;
  EXPECT_THAT(ExportWholeSurface(scene, folder.path(), options)[0].summary,
              HasSubstr("1 shell, no cavities, genus 0"));
  EXPECT_THAT(ExportSurfaces(labelled, folder.path(), options)[0].summary,
              HasSubstr("1 shell, no cavities, genus 0"));
  EXPECT_EQ(options.Check(), "");
  options.method = SurfaceMethod::kCells;
  EXPECT_THAT(options.Check(), HasSubstr("close_sheets needs the method smooth"));
}

TEST(OpenSheet, WithoutFiguresOfTheRaysSurfacesAreClosed) {
  const TempFolder folder;
  Model model = Slab();
  model.statistics.passed.clear();
  model.statistics.stopped.clear();
  EXPECT_THAT(ExportWholeSurface(MakeWholeScene(model), folder.path(), {})[0].summary,
              Not(HasSubstr("sheet")));
}

TEST(OpenSheet, TheSameOnAnyNumberOfThreads) {
  std::vector<ObjectSurface> sheets;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    const ExportableScene scene = MakeExportableScene(Slab());
    const ObjectSurface cells = ExtractSurface(scene, scene.objects[0]);
    sheets.push_back(OpenSheet(ExtractSmoothSurface(scene, scene.objects[0], cells)));
    EXPECT_EQ(sheets.back().vertices, sheets[0].vertices);
    EXPECT_EQ(sheets.back().triangles, sheets[0].triangles);
  }
}

}  // namespace
}  // namespace semfoam
