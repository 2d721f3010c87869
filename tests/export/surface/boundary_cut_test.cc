// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/boundary_cut.h"

#include "foam/model/activation.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "tests/export/test_foams.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr float kSpacing = 0.1f;
constexpr int kHaze = -2;
using Class = std::function<int(const Eigen::Vector3f&)>;
// Light that passed and that stopped.
using Looks = std::function<std::pair<float, float>(const Eigen::Vector3f&)>;

// Sites on a grid of that spacing of the classes of MakeModel, or kHaze: too thin to be solid, but
// no clear air. All are photographed.
ExportableScene Scene(int num_classes, const Class& class_of, const Looks& looks_of) {
  Model model = MakeModel(GridSites(16, kSpacing, 0.1f, 1),
                          num_classes,
                          [&](const Eigen::Vector3f& p) { return std::max(class_of(p), kAir); });
  const size_t n = model.foam.NumSites();
  model.statistics.contribution.assign(n, 1.f);
  for (size_t i = 0; i < n; ++i) {
    const Eigen::Vector3f& p = model.foam.positions[i];
    if (class_of(p) == kHaze) {
      model.foam.raw_density[i] = static_cast<float>(RawDensity(0.03 / (0.5 * kSpacing)));
    }
    const auto [passed, stopped] = looks_of(p);
    model.statistics.passed.push_back(passed);
    model.statistics.stopped.push_back(stopped);
  }
  return MakeExportableScene(model);
}

bool InCube(const Eigen::Vector3f& p) { return p.cwiseAbs().maxCoeff() < 0.5f; }

bool IsAt(const Eigen::Vector3f& p, float x, float y, float z) {
  return (p - Eigen::Vector3f(x, y, z)).cwiseAbs().maxCoeff() < 0.5f * kSpacing;
}

std::vector<uint32_t> CellsWhere(const ExportableScene& scene,
                                 const std::function<bool(const Eigen::Vector3f&)>& is_in) {
  std::vector<uint32_t> cells;
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    if (is_in(scene.cell_positions[i])) cells.push_back(i);
  }
  return cells;
}

TEST(BoundaryCut, PitsAreFilledAndTuftsCutWhereLittleLightSpeaksForThem) {
  const auto in_pit = [](const Eigen::Vector3f& p) {
    return IsAt(p, 0.05f, 0.05f, 0.45f) || IsAt(p, 0.05f, 0.05f, 0.35f);
  };
  const auto in_tuft = [](const Eigen::Vector3f& p) { return IsAt(p, 0.55f, 0.05f, 0.05f); };
  for (const float looks : {10.f, 1e4f}) {
    const ExportableScene scene = Scene(
        1,
        [&](const Eigen::Vector3f& p) {
          if (in_pit(p)) return looks < 100 ? kHaze : kAir;
          return InCube(p) || in_tuft(p) ? 0 : kAir;
        },
        [&](const Eigen::Vector3f& p) -> std::pair<float, float> {
          // Enough that it is not taken for unseen.
          if (in_pit(p)) return {std::max(looks, 25.f), 0.f};
          if (in_tuft(p)) return {0.f, looks};
          return InCube(p) ? std::pair(0.f, 1000.f) : std::pair(1000.f, 0.f);
        });
    const std::vector<uint32_t>& before = scene.objects.at(0).cells;
    ASSERT_EQ(before, CellsWhere(scene, [&](const Eigen::Vector3f& p) {
                return (InCube(p) && !in_pit(p)) || in_tuft(p);
              }));
    const std::vector<uint32_t> after = CutBoundary(scene, {}, before);
    if (looks < 100) {
      EXPECT_EQ(after, CellsWhere(scene, InCube));
    } else {
      EXPECT_EQ(after, before) << "what photos show beyond doubt stays";
    }
  }
}

TEST(BoundaryCut, LeavesOfOneCellStay) {
  const auto in_leaf = [](const Eigen::Vector3f& p) {
    return p.z() > 0 && p.z() < kSpacing && p.head<2>().cwiseAbs().maxCoeff() < 0.4f;
  };
  const ExportableScene scene = Scene(
      1,
      [&](const Eigen::Vector3f& p) { return in_leaf(p) ? 0 : kAir; },
      [&](const Eigen::Vector3f& p) {
        return in_leaf(p) ? std::pair(0.f, 500.f) : std::pair(500.f, 0.f);
      });
  EXPECT_EQ(CutBoundary(scene, {}, scene.objects.at(0).cells), CellsWhere(scene, in_leaf));
}

// A cup of small cells, full of haze in large ones.
TEST(BoundaryCut, HollowsOfLargeThinCellsThatLightPassesAreEmptied) {
  const auto in_hollow = [](const Eigen::Vector3f& p) {
    return p.head<2>().cwiseAbs().maxCoeff() < 0.3f && p.z() > -0.3f && p.z() < 0.4f;
  };
  const auto in_cup = [&](const Eigen::Vector3f& p) {
    return p.cwiseAbs().maxCoeff() < 0.4f && !in_hollow(p);
  };
  const float thin = 0.12f;  // density times radius
  for (const bool is_large : {true, false}) {
    for (const float passed : {50.f, 5.f}) {
      std::vector<Eigen::Vector3f> sites;
      for (const Eigen::Vector3f& p : GridSites(20, 0.5f * kSpacing, 0.1f, 1)) {
        if (!is_large || !in_hollow(p)) sites.push_back(p);
      }
      for (const Eigen::Vector3f& p : GridSites(16, kSpacing, 0.1f, 1)) {
        if (p.cwiseAbs().maxCoeff() > 0.55f || (is_large && in_hollow(p))) sites.push_back(p);
      }
      Model model = MakeModel(
          sites, 1, [&](const Eigen::Vector3f& p) { return in_cup(p) || in_hollow(p) ? 0 : kAir; });
      const float radius = (is_large ? 0.5f : 0.25f) * kSpacing;
      for (size_t i = 0; i < sites.size(); ++i) {
        const bool is_haze = in_hollow(sites[i]);
        if (is_haze) model.foam.raw_density[i] = static_cast<float>(RawDensity(thin / radius));
        model.statistics.contribution.push_back(1);
        model.statistics.passed.push_back(is_haze ? passed : in_cup(sites[i]) ? 0 : 1000);
        model.statistics.stopped.push_back(is_haze ? 2 : in_cup(sites[i]) ? 1000 : 0);
      }
      const ExportableScene scene = MakeExportableScene(model);
      const std::vector<uint32_t>& before = scene.objects.at(0).cells;
      ASSERT_GT(before.size(), CellsWhere(scene, in_cup).size());
      const std::vector<uint32_t> after = CutBoundary(scene, {}, before);
      const std::vector<uint32_t> cup = CellsWhere(scene, in_cup);
      if (is_large && passed > 10) {
        // Along edges and in corners they may stay, where most of a cell's faces are walls.
        EXPECT_TRUE(std::includes(after.begin(), after.end(), cup.begin(), cup.end()));
        EXPECT_LT(after.size() - cup.size(), (before.size() - cup.size()) / 4);
        EXPECT_EQ(CutBoundary(scene, {}, before, WholeSpace(), /*opens_hollows=*/false), before);
      } else {
        EXPECT_EQ(after, before) << "what light stops in stays, and so do small cells: gloss";
      }
    }
  }
}

TEST(BoundaryCut, ThinObjectsOfLittleEvidenceDoNotVanish) {
  const auto in_leaf = [](const Eigen::Vector3f& p) {
    return p.z() > 0 && p.z() < kSpacing && p.head<2>().cwiseAbs().maxCoeff() < 0.4f;
  };
  const ExportableScene scene = Scene(
      1,
      [&](const Eigen::Vector3f& p) { return in_leaf(p) ? 0 : kAir; },
      [&](const Eigen::Vector3f& p) {
        return in_leaf(p) ? std::pair(0.f, 0.5f) : std::pair(500.f, 0.f);
      });
  EXPECT_EQ(CutBoundary(scene, {}, scene.objects.at(0).cells), CellsWhere(scene, in_leaf));
}

TEST(BoundaryCut, WithoutFiguresOfTheRaysNothingChanges) {
  const ExportableScene scene =
      MakeExportableScene(MakeModel(RandomSites(800, 3), 1, [](const Eigen::Vector3f& p) {
        return std::sin(9 * p.x()) * std::cos(8 * p.y()) > 0 ? 0 : kAir;
      }));
  EXPECT_EQ(CutBoundary(scene, {}, scene.objects.at(0).cells), scene.objects[0].cells);
}

TEST(BoundaryCut, NoCellOutOfTheBoxIsAdded) {
  const ExportableScene scene = Scene(
      1,
      [](const Eigen::Vector3f& p) { return InCube(p) ? 0 : kAir; },
      [](const Eigen::Vector3f& p) {
        return InCube(p) ? std::pair(0.f, 500.f) : std::pair(500.f, 0.f);
      });
  Eigen::AlignedBox3d box = WholeSpace();
  // Through a layer of sites, which are off by up to a tenth of their spacing.
  box.max().x() = 0.25;
  const std::vector<uint32_t> within = CellsInBox(scene, scene.objects.at(0).cells, box);
  ASSERT_LT(within.size(), scene.objects[0].cells.size());
  EXPECT_EQ(CutBoundary(scene, {}, within, box), within);
  EXPECT_GT(CutBoundary(scene, {}, within).size(), within.size());
}

// The body of class 0 stands on the support of class 1, whose surface is at z = -0.3.
TEST(BoundaryCut, HiddenCellsOfTheSupportBecomeTheBodysAboveTheContact) {
  const auto is_taken = [](const Eigen::Vector3f& p) { return IsAt(p, 0.05f, 0.05f, -0.25f); };
  const auto in_body = [](const Eigen::Vector3f& p) {
    return p.z() > -0.3f && p.z() < 0.3f && p.head<2>().cwiseAbs().maxCoeff() < 0.3f;
  };
  const auto in_support = [](const Eigen::Vector3f& p) { return p.z() < -0.3f; };
  const ExportableScene scene = Scene(
      2,
      [&](const Eigen::Vector3f& p) {
        if (in_support(p) || is_taken(p)) return 1;
        return in_body(p) ? 0 : kAir;
      },
      [&](const Eigen::Vector3f& p) -> std::pair<float, float> {
        if (is_taken(p)) return {0.f, 0.f};
        return in_body(p) || in_support(p) ? std::pair(0.f, 500.f) : std::pair(500.f, 0.f);
      });
  ASSERT_EQ(scene.objects.size(), 2u);
  const std::vector<uint32_t>& before = scene.objects[0].cells;
  EXPECT_EQ(CutBoundary(scene, {}, before), before);
  const ContactPlane contact{{Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0, 0, -0.3)}, kSpacing};
  EXPECT_EQ(CutBoundary(scene, {contact}, before), CellsWhere(scene, in_body));
}

}  // namespace
}  // namespace semfoam
