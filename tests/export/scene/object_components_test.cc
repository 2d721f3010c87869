// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/object_components.h"

#include "export/scene/object_selection.h"
#include "foam/util/error.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "tests/export/test_foams.h"
#include "tests/mistake.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Of class 0: a large and a middling ball, three cells in a row, and a single cell. Of class 1: a
// pair of cells. Numbers of the components, 0 = air. The outermost cells, which are large, are air.
int ComponentAt(const Eigen::Vector3f& p) {
  const auto is_outer = [](float x) { return x > 0.75f && x < 0.85f; };
  if ((p + Eigen::Vector3f::Constant(0.3f)).norm() < 0.5f) return 1;
  if ((p - Eigen::Vector3f::Constant(0.5f)).norm() < 0.3f) return 2;
  if (p.x() > 0.5f && p.x() < 0.85f && is_outer(-p.y()) && is_outer(-p.z())) return 3;
  if (!is_outer(-p.x()) || !is_outer(p.y())) return 0;
  if (is_outer(p.z())) return 4;
  return p.z() < -0.65f && p.z() > -0.85f ? 5 : 0;
}

Model Components() {
  return MakeModel(GridSites(16, 0.125f, 0, 0), 2, [](const Eigen::Vector3f& p) {
    const int component = ComponentAt(p);
    return component == 0 ? kAir : component == 5 ? 1 : 0;
  });
}

ExportableScene Kept(int64_t min_cells, int keep_largest, double scale = 1) {
  Model model = Components();
  model.world_from_normalized = {scale, {100, 200, 300}};
  ExportableSceneOptions options;
  options.components = {min_cells, keep_largest};
  return MakeExportableScene(model, options);
}

// The cells of each component that belong to any object.
std::map<int, int> CellsOfComponents(const ExportableScene& scene) {
  std::map<int, int> cells;
  for (const ObjectInfo& object : scene.objects) {
    for (const uint32_t cell : object.cells) ++cells[ComponentAt(scene.cell_positions[cell])];
  }
  return cells;
}

TEST(ObjectComponents, ByDefaultTheCrumbRuleAloneCounts) {
  const ExportableScene scene = Kept(0, 0);
  const std::map<int, int> cells = CellsOfComponents(scene);
  ASSERT_EQ(cells.size(), 3u);
  EXPECT_EQ(cells.count(3) + cells.count(4), 0u);
  ASSERT_EQ(scene.objects.size(), 2u);
  EXPECT_EQ(scene.objects[0].components, 2);
  EXPECT_EQ(scene.objects[0].left_out.components, 2);
  EXPECT_EQ(scene.objects[0].left_out.cells, 4);
  EXPECT_EQ(scene.objects[1].components, 1);
  EXPECT_EQ(scene.objects[1].left_out.components, 0);
  EXPECT_THAT(scene.labels_left_out, IsEmpty());
}

TEST(ObjectComponents, TooFewCellsAreLeftOutInsteadOfCrumbs) {
  EXPECT_EQ(CellsOfComponents(Kept(1, 0)).size(), 5u) << "every component has a cell";
  EXPECT_EQ(CellsOfComponents(Kept(2, 0)).count(4), 0u);
  EXPECT_EQ(CellsOfComponents(Kept(3, 0)).at(3), 3);
  EXPECT_EQ(CellsOfComponents(Kept(4, 0)).count(3), 0u);
  EXPECT_EQ(CellsOfComponents(Kept(4, 0)).size(), 2u);
}

TEST(ObjectComponents, TheLargestOfEachObjectAreKept) {
  const ExportableScene one = Kept(0, 1);
  std::map<int, int> cells = CellsOfComponents(one);
  EXPECT_EQ(cells.size(), 2u) << "one of each object";
  EXPECT_EQ(cells.count(1) + cells.count(5), 2u);
  EXPECT_EQ(one.objects[0].components, 1);
  EXPECT_EQ(one.objects[0].left_out.components, 3);
  cells = CellsOfComponents(Kept(1, 3));
  EXPECT_EQ(cells.count(1) + cells.count(2) + cells.count(3), 3u);
  EXPECT_EQ(cells.count(4), 0u);
  EXPECT_EQ(CellsOfComponents(Kept(1, 9)), CellsOfComponents(Kept(1, 0)));
}

TEST(ObjectComponents, SaysWhatIsLeftOutInTheFrameOfTheFiles) {
  const ExportableScene scene = Kept(4, 1, 2);
  ASSERT_EQ(scene.objects.size(), 1u);
  const LeftOutComponents& left_out = scene.objects[0].left_out;
  EXPECT_EQ(left_out.components, 3);
  double volume = 0, weight = 0;
  int64_t cells = 0, largest = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    const int component = ComponentAt(scene.cell_positions[i]);
    if (component < 2 || component > 4) continue;
    ++cells;
    volume += scene.volume[i];
    if (component != 2) continue;
    ++largest;
    weight += scene.volume[i];
    center += scene.volume[i] * scene.cell_positions[i].cast<double>();
  }
  EXPECT_EQ(left_out.cells, cells);
  EXPECT_NEAR(left_out.volume, 8 * volume, 1e-9 * volume);
  EXPECT_EQ(left_out.largest_cells, largest);
  EXPECT_NEAR(left_out.largest_volume, 8 * weight, 1e-9 * weight);
  const Eigen::Vector3d expected = Eigen::Vector3d(100, 200, 300) + 2 * center / weight;
  EXPECT_LT((left_out.largest_center - expected).norm(), 1e-9);
}

TEST(ObjectComponents, AnObjectThatLosesAllItsComponentsIsNone) {
  const ExportableScene scene = Kept(4, 0);
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_EQ(scene.objects[0].id, LabelId{7});
  ASSERT_EQ(scene.labels_left_out.size(), 1u);
  EXPECT_EQ(scene.labels_left_out[0].id, LabelId{8});
  EXPECT_EQ(scene.labels_left_out[0].name, "label_8");
  EXPECT_EQ(scene.labels_left_out[0].left_out.cells, 2);
  EXPECT_THAT(scene.labels_without_cells, IsEmpty());
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    const int component = ComponentAt(scene.cell_positions[i]);
    EXPECT_EQ(scene.object_of_cell[i], component == 1 || component == 2 ? 0 : -1);
  }
  try {
    SelectObjects(scene, LabelChoice{"label_8"});
    FAIL();
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), HasSubstr("'label_8', all of whose components are left out"));
  }
  EXPECT_THAT(Kept(100000, 0).objects, IsEmpty());
}

// A block of class 0 with some 17 000 cells, a small ball of class 1, and `count` cells of class 2,
// each by itself or all in a lump. `identity` says how sure these are, 3 as the others or less.
Model WithAFragment(int count, bool in_a_lump, float identity) {
  const std::vector<Eigen::Vector3f> sites = GridSites(32, 0.06f, 0.2f, 3);
  std::vector<int> classes(sites.size(), kAir);
  std::vector<size_t> order(sites.size());
  std::iota(order.begin(), order.end(), size_t{0});
  const Eigen::Vector3f middle(0.75f, 0.5f, 0.5f);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return (sites[a] - middle).norm() < (sites[b] - middle).norm();
  });
  int left = count;
  std::vector<size_t> chosen;
  for (size_t k = 0; k < order.size(); ++k) {
    const Eigen::Vector3f& p = sites[order[k]];
    if (p.x() < 0.5f && p.cwiseAbs().maxCoeff() < 0.85f) classes[order[k]] = 0;
    if ((p - Eigen::Vector3f(0.75f, -0.5f, -0.5f)).norm() < 0.15f) classes[order[k]] = 1;
    if (left == 0) continue;
    const bool is_apart = std::none_of(chosen.begin(), chosen.end(), [&](size_t other) {
      return (sites[other] - p).norm() < 0.15f;
    });
    if (classes[order[k]] != kAir || (!in_a_lump && !is_apart)) continue;
    chosen.push_back(order[k]);
    classes[order[k]] = 2;
    --left;
  }
  EXPECT_EQ(left, 0);
  size_t index = 0;
  Model model = MakeModel(sites, 3, [&](const auto&) { return classes[index++]; });
  for (size_t i = 0; i < sites.size(); ++i) {
    if (classes[i] == 2) model.foam.identity[i * kIdentityDim + 2] = identity;
  }
  return model;
}

TEST(ObjectComponents, FragmentsAreNoObjects) {
  const auto left_out = [](const Model& model, bool keep_fragments = false, int64_t min_cells = 0) {
    ExportableSceneOptions options;
    options.components.keep_fragments = keep_fragments;
    options.components.min_cells = min_cells;
    const ExportableScene scene = MakeExportableScene(model, options);
    for (const int32_t object : scene.object_of_cell) EXPECT_LT(object, std::ssize(scene.objects));
    EXPECT_EQ(scene.objects.size() + scene.labels_left_out.size(), 3u);
    return scene.labels_left_out;
  };
  constexpr float kSure = 3, kUnsure = 0.3f;
  // Scattered cells, however sure.
  const std::vector<LeftOutLabel> scattered = left_out(WithAFragment(12, false, kSure));
  ASSERT_EQ(scattered.size(), 1u);
  EXPECT_EQ(scattered[0].id, LabelId{9});
  EXPECT_TRUE(scattered[0].is_fragment);
  EXPECT_EQ(scattered[0].left_out.cells, 12);
  EXPECT_THAT(scattered[0].reason, HasSubstr("a fragment: 12 cells, 0.0"));
  EXPECT_THAT(scattered[0].reason, HasSubstr("; confidence 0.9"));
  // Cells of which the photos say different things, however they hang together.
  EXPECT_EQ(left_out(WithAFragment(12, true, kUnsure)).size(), 1u);
  // Who wants them has them.
  EXPECT_THAT(left_out(WithAFragment(12, false, kSure), true), IsEmpty());
  EXPECT_THAT(left_out(WithAFragment(12, false, kSure), false, 1), IsEmpty());
  // A small thing that the photos agree about is none, nor is a thing of some size.
  EXPECT_THAT(left_out(WithAFragment(12, true, kSure)), IsEmpty());
  EXPECT_THAT(left_out(WithAFragment(3, true, kSure)), IsEmpty());
  // A single cell has no shape, however sure.
  EXPECT_EQ(left_out(WithAFragment(1, true, kSure)).size(), 1u);
  EXPECT_THAT(left_out(WithAFragment(40, true, kUnsure)), IsEmpty());
  EXPECT_THAT(left_out(WithAFragment(40, false, kSure)), IsEmpty());
}

TEST(ObjectComponents, AFragmentIsNamedToWhoAsksForIt) {
  const ExportableScene scene = MakeExportableScene(WithAFragment(12, false, 3));
  try {
    SelectObjects(scene, LabelChoice{"9"});
    FAIL();
  } catch (const UserError& error) {
    EXPECT_THAT(
        error.what(),
        NamesMistake(
            "", {"'9'", "keep_fragments", "7 (mug)", "8 (label_8)"}, "left out as a fragment"));
  }
}

// The first object goes, and the second takes its place in every table.
TEST(ObjectComponents, IndicesFollowTheObjectsThatStay) {
  Model model = Components();
  std::swap(model.labels[0].id, model.labels[1].id);
  ExportableSceneOptions options;
  options.components.min_cells = 4;
  const ExportableScene scene = MakeExportableScene(model, options);
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_EQ(scene.objects[0].id, LabelId{8});
  for (const uint32_t cell : scene.objects[0].cells) EXPECT_EQ(scene.object_of_cell[cell], 0);
}

}  // namespace
}  // namespace semfoam
