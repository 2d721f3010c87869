// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/clean_cells.h"

#include "export/scene/object_surface.h"
#include "export/scene/surface_topology.h"
#include "foam/model/activation.h"

#include <cmath>
#include <functional>

#include "tests/export/test_foams.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr float kSpacing = 0.1f;

// Sites on a grid of that spacing; those for which `is_solid` holds are one object, and of the
// others those for which `is_faint` holds are too thin to be solid, but no clear air.
ExportableScene Scene(const std::function<bool(const Eigen::Vector3f&)>& is_solid,
                      const std::function<bool(const Eigen::Vector3f&)>& is_faint) {
  Model model = MakeModel(GridSites(16, kSpacing, 0.1f, 1), 1, [&](const Eigen::Vector3f& p) {
    return is_solid(p) ? 0 : kAir;
  });
  for (size_t i = 0; i < model.foam.NumSites(); ++i) {
    if (is_solid(model.foam.positions[i]) || !is_faint(model.foam.positions[i])) continue;
    model.foam.raw_density[i] = static_cast<float>(RawDensity(0.03 / (0.5 * kSpacing)));
  }
  return MakeExportableScene(model);
}

bool Always(const Eigen::Vector3f&) { return true; }
bool Never(const Eigen::Vector3f&) { return false; }

SurfaceTopology Topology(const ExportableScene& scene, const std::vector<uint32_t>& cells) {
  ObjectInfo object = scene.objects.at(0);
  object.cells = cells;
  const ObjectSurface surface = ExtractSurface(scene, object);
  return TopologyOf(surface.vertices.size(), surface.triangles);
}

bool InCube(const Eigen::Vector3f& p) { return p.cwiseAbs().maxCoeff() < 0.5f; }

// A cube of which some places are air.
std::function<bool(const Eigen::Vector3f&)> CubeWithout(
    const std::function<bool(const Eigen::Vector3f&)>& is_air) {
  return [is_air](const Eigen::Vector3f& p) { return InCube(p) && !is_air(p); };
}

TEST(CleanCells, ATunnelOfOneCellIsClosedAndCounted) {
  const auto in_tunnel = [](const Eigen::Vector3f& p) {
    return std::abs(p.x() - 0.05f) < 0.05f && std::abs(p.y() - 0.05f) < 0.05f;
  };
  const ExportableScene scene = Scene(CubeWithout(in_tunnel), Always);
  ASSERT_EQ(Topology(scene, scene.objects[0].cells).genus, 1);
  const CleanCells clean = FillPitsAndTunnels(scene, scene.objects[0].cells);
  EXPECT_EQ(Topology(scene, clean.cells).genus, 0);
  EXPECT_EQ(Topology(scene, clean.cells).shells, 1);
  EXPECT_GE(clean.tunnels + clean.pits, 1);
  // Where photos show that it is clear, it is none of training's mistakes.
  const ExportableScene clear = Scene(CubeWithout(in_tunnel), Never);
  const CleanCells kept = FillPitsAndTunnels(clear, clear.objects[0].cells);
  EXPECT_EQ(kept.cells, clear.objects[0].cells);
  EXPECT_EQ(kept.tunnels, 0);
  EXPECT_EQ(kept.pits, 0);
}

TEST(CleanCells, WideTunnelsStay) {
  const ExportableScene scene = Scene(CubeWithout([](const Eigen::Vector3f& p) {
                                        return std::abs(p.x()) < 0.2f && std::abs(p.y()) < 0.2f;
                                      }),
                                      Always);
  ASSERT_EQ(Topology(scene, scene.objects[0].cells).genus, 1);
  const CleanCells clean = FillPitsAndTunnels(scene, scene.objects[0].cells);
  EXPECT_EQ(Topology(scene, clean.cells).genus, 1);
  EXPECT_EQ(clean.tunnels, 0);
}

// A ring of one cell's thickness is a handle, and a bridge over a gap of one cell is none.
TEST(CleanCells, OnlyShortBridgesAreCut) {
  const auto in_ring = [](const Eigen::Vector3f& p) {
    return std::abs(p.z() - 0.05f) < 0.05f && std::abs(p.x()) < 0.6f && std::abs(p.y()) < 0.6f &&
           (std::abs(p.x()) > 0.5f || std::abs(p.y()) > 0.5f);
  };
  const ExportableScene ring = Scene(in_ring, Never);
  ASSERT_EQ(Topology(ring, ring.objects[0].cells).genus, 1);
  EXPECT_EQ(FillPitsAndTunnels(ring, ring.objects[0].cells).cells, ring.objects[0].cells);

  const ExportableScene bridge = Scene(
      [](const Eigen::Vector3f& p) {
        const bool in_slit = std::abs(p.x() - 0.05f) < 0.05f && p.z() > 0.2f;
        const bool in_bridge = p.z() > 0.4f && std::abs(p.y() - 0.05f) < 0.05f;
        return InCube(p) && (!in_slit || in_bridge);
      },
      Never);
  ASSERT_EQ(Topology(bridge, bridge.objects[0].cells).genus, 1);
  const CleanCells cut = FillPitsAndTunnels(bridge, bridge.objects[0].cells);
  EXPECT_EQ(Topology(bridge, cut.cells).genus, 0);
  EXPECT_EQ(Topology(bridge, cut.cells).shells, 1);
  EXPECT_EQ(cut.tunnels, 1);
  EXPECT_LT(cut.cells.size(), bridge.objects[0].cells.size());
}

TEST(CleanCells, PitsAreFilledAndNothingElse) {
  const auto in_pit = [](const Eigen::Vector3f& p) {
    return (p - Eigen::Vector3f(0.05f, 0.05f, 0.45f)).cwiseAbs().maxCoeff() < 0.05f;
  };
  const ExportableScene scene = Scene(CubeWithout(in_pit), Always);
  const CleanCells clean = FillPitsAndTunnels(scene, scene.objects[0].cells);
  EXPECT_EQ(clean.pits, 1);
  ASSERT_EQ(clean.cells.size(), scene.objects[0].cells.size() + 1);
  for (const uint32_t cell : clean.cells) {
    EXPECT_TRUE(InCube(scene.cell_positions[cell])) << scene.cell_positions[cell].transpose();
  }
}

TEST(CleanCells, CellsOfOtherObjectsAreNotTaken) {
  const Model model = TouchingBalls();
  const ExportableScene scene = MakeExportableScene(model);
  for (int32_t k = 0; k < 2; ++k) {
    for (const uint32_t cell : FillPitsAndTunnels(scene, scene.objects[k].cells).cells) {
      EXPECT_NE(scene.object_of_cell[cell], 1 - k);
    }
  }
}

}  // namespace
}  // namespace semfoam
