// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/edit/object_editing.h"

#include "foam/edit/model_sites.h"
#include "foam/model/classifier.h"
#include "foam/render/compositing.h"
#include "foam/render/ray_tracer.h"

#include <array>
#include <map>
#include <set>
#include <vector>

#include "tests/foam/edit/object_scenes.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using Place = std::array<float, 3>;

std::set<Place> Places(const Model& model, const std::vector<uint32_t>& sites) {
  std::set<Place> places;
  for (const uint32_t i : sites) {
    const Eigen::Vector3f& x = model.foam.positions[i];
    places.insert({x.x(), x.y(), x.z()});
  }
  return places;
}

// The same sites, all but those of the objects empty, or only those of the objects.
Model WithEmptied(Model model, const ObjectCells& object, bool keep_object) {
  std::vector<uint8_t> is_object(model.foam.NumSites(), 0);
  for (const uint32_t i : object.cells) is_object[i] = 1;
  for (uint32_t i = 0; i < model.foam.NumSites(); ++i) {
    if (is_object[i] != keep_object) MakeEmpty(i, &model);
  }
  return model;
}

int32_t ClassOf(const Foam& foam, uint32_t site) {
  std::vector<float> logits(foam.num_classes);
  ClassLogits(foam, &foam.identity[site * kIdentityDim], logits.data());
  return ArgmaxSoftmax(logits).class_index;
}

TEST(ObjectEditingExtract, HoldsTheObjectAndARingOfEmptyCells) {
  const Model scene = RingTableBallModel();
  const ObjectCells ring = CellsOf(scene, kRing);
  const ExtractedObjects extracted = Extract(scene, kRing);
  const Model& model = extracted.model;
  ASSERT_EQ(model.foam.NumSites(), extracted.object_of_site.size());
  ASSERT_EQ(model.foam.num_classes, 1);
  EXPECT_EQ(model.labels[0].id, LabelId{10});
  std::vector<uint32_t> object, around;
  for (uint32_t i = 0; i < model.foam.NumSites(); ++i) {
    (extracted.object_of_site[i] >= 0 ? object : around).push_back(i);
  }
  EXPECT_EQ(Places(model, object), Places(scene, ring.cells));
  EXPECT_GT(around.size(), 100u);
  for (const uint32_t i : object) EXPECT_GT(Density(model.foam.raw_density[i]), 100);
  for (const uint32_t i : around) {
    EXPECT_LT(Density(model.foam.raw_density[i]), kTransparentDensity);
  }
}

TEST(ObjectEditingExtract, LooksAsItDidWithNothingElseThere) {
  const Model scene = RingTableBallModel();
  const Model extracted = Extract(scene, kRing).model;
  const Model alone = WithEmptied(scene, CellsOf(scene, kRing), /*keep_object=*/true);
  for (const CameraRays& view : SomeViews()) {
    const RenderedView rendered = Render(extracted, view);
    EXPECT_LT(LargestDifference(rendered, Render(alone, view)), 1e-4f);
    EXPECT_GT(*std::max_element(rendered.opacity.begin(), rendered.opacity.end()), 0.99f);
  }
}

// A convex hull of the ring would take the ball in its hole.
TEST(ObjectEditingExtract, AHoleStaysAHole) {
  const Model scene = RingTableBallModel();
  const ObjectCells ring = CellsOf(scene, kRing), ball = CellsOf(scene, kBall);
  ASSERT_GT(ball.cells.size(), 20u);
  for (const uint32_t b : ball.cells) {
    for (int k = 0; k < 100; ++k) {
      CounterRandom random(2, b, k);
      const Eigen::Vector3f d = RandomDirection(&random).cast<float>();
      EXPECT_TRUE(std::any_of(ring.cells.begin(), ring.cells.end(), [&](uint32_t r) {
        return d.dot(scene.foam.positions[r] - scene.foam.positions[b]) > 0;
      })) << "a ball outside of the ring's hull proves nothing";
    }
  }
  const Model extracted = Extract(scene, kRing).model;
  const CameraRays down = LookAt({0, 0, 2}, {0, 0, 0});
  const size_t middle = size_t(40) * 80 + 40;
  EXPECT_GT(Render(scene, down).opacity[middle], 0.99f);
  EXPECT_LT(Render(extracted, down).opacity[middle], 1e-3f);
}

TEST(ObjectEditingExtract, HiddenCellsOfOtherClassesBecomeTheObjects) {
  Model scene = RingTableBallModel();
  ObjectCells ring = CellsOf(scene, kRing), ball = CellsOf(scene, kBall);
  // Some of the ring's cells are taken for ball and table, as unseen ones are.
  for (size_t k = 0; k < ring.cells.size(); k += 5) {
    float* identity = &scene.foam.identity[ring.cells[k] * kIdentityDim];
    std::fill_n(identity, kIdentityDim, 0.f);
    identity[k % 2 == 0 ? kBall : kTable] = 3;
  }
  const ExtractedObjects both =
      ExtractObjects(scene, TriangulateModel(scene), {std::move(ball), std::move(ring)});
  ASSERT_EQ(both.model.foam.num_classes, 2);
  EXPECT_EQ(both.model.labels[0].id, LabelId{12});  // in the order of the call
  EXPECT_EQ(both.model.labels[1].id, LabelId{10});
  for (uint32_t i = 0; i < both.model.foam.NumSites(); ++i) {
    if (both.object_of_site[i] < 0) continue;
    EXPECT_EQ(ClassOf(both.model.foam, i), both.object_of_site[i]);
  }
}

// Nothing is known where no photo looks: there an object must not hide behind what was assumed.
TEST(ObjectEditing, WhatIsAssumedWhereNoPhotoLooksGoes) {
  Model scene = RingTableBallModel();
  const Model plain = Remove(scene, kRing);
  scene.foam.assumed_density.assign(scene.foam.NumSites(), 0.f);
  for (size_t i = 0; i < scene.foam.NumSites(); i += 3) scene.foam.assumed_density[i] = 500;
  EXPECT_TRUE(Extract(scene, kRing).model.foam.assumed_density.empty());
  const Model removed = Remove(scene, kRing);
  EXPECT_TRUE(removed.foam.assumed_density.empty());
  EXPECT_EQ(removed.foam.raw_density, plain.foam.raw_density);
}

TEST(ObjectEditingExtract, StatisticsComeAlongAndCallTheRingEmpty) {
  Model scene = RingTableBallModel();
  const size_t n = scene.foam.NumSites();
  scene.statistics.contribution.assign(n, 0.5f);
  scene.statistics.mean_color.assign(n, {0.1f, 0.2f, 0.3f});
  scene.statistics.passed.assign(n, 1.f);
  scene.statistics.stopped.assign(n, 70.f);
  const ExtractedObjects extracted = Extract(scene, kRing);
  const CellStatistics& statistics = extracted.model.statistics;
  for (uint32_t i = 0; i < extracted.model.foam.NumSites(); ++i) {
    const bool is_ring = extracted.object_of_site[i] < 0;
    EXPECT_EQ(statistics.contribution[i], is_ring ? 0.f : 0.5f);
    EXPECT_EQ(statistics.stopped[i], is_ring ? 0.f : 70.f);
    EXPECT_GE(statistics.passed[i], is_ring ? 100.f : 1.f);
    EXPECT_EQ(statistics.mean_color[i].z(), 0.3f);
  }
}

TEST(ObjectEditingRemove, NothingElseChangesItsShape) {
  const Model scene = RingTableBallModel();
  const Model removed = Remove(scene, kRing);
  const ObjectCells ring = CellsOf(scene, kRing);
  // Of the ring's cells, those that touch nothing else are gone.
  std::vector<uint8_t> is_ring(scene.foam.NumSites() + kNumGuardSites, 0);
  for (const uint32_t i : ring.cells) is_ring[i] = 1;
  const Delaunay delaunay = TriangulateModel(scene);
  size_t inner = 0;
  for (const uint32_t i : ring.cells) {
    const auto around = delaunay.Neighbors(i);
    inner += std::all_of(around.begin(), around.end(), [&](uint32_t j) { return is_ring[j]; });
  }
  EXPECT_GT(inner, 30u);
  EXPECT_EQ(removed.foam.NumSites(), scene.foam.NumSites() - inner);
  const Model emptied = WithEmptied(scene, ring, /*keep_object=*/false);
  for (const CameraRays& view : SomeViews()) {
    EXPECT_LT(LargestDifference(Render(removed, view), Render(emptied, view)), 1e-4f);
  }
}

TEST(ObjectEditingRemove, PixelsThatNeverSawTheObjectStay) {
  const Model scene = RingTableBallModel();
  const Model removed = Remove(scene, kRing);
  std::vector<uint8_t> is_ring(scene.foam.NumSites() + kNumGuardSites, 0);
  for (const uint32_t i : CellsOf(scene, kRing).cells) is_ring[i] = 1;
  const ViewRenderer renderer(scene.foam);
  int unseen = 0, seen_and_changed = 0;
  for (const CameraRays& view : SomeViews()) {
    const RenderedView before = renderer.Render(view), after = Render(removed, view);
    for (size_t i = 0; i < before.color.size(); ++i) {
      const std::span<RayTrace> traces = ThreadTraces(1);
      traces[0].origin = view.origin.cast<float>();
      traces[0].direction = view.directions[i];
      traces[0].start_cell = renderer.StartCell(view.origin);
      const float cutoff_tau = static_cast<float>(-std::log(kTransmittanceCutoff));
      TraceRays(renderer.geometry(), renderer.shading(), cutoff_tau, traces);
      bool saw_ring = false;
      for (int k = 0; k < traces[0].num_segments; ++k) {
        saw_ring = saw_ring || is_ring[traces[0].segments[k].cell];
      }
      const float change = (after.color[i] - before.color[i]).cwiseAbs().maxCoeff();
      if (!saw_ring) {
        EXPECT_LT(change, 1.f / 255);
        ++unseen;
      } else if (change > 0.1f) {
        ++seen_and_changed;
      }
    }
  }
  EXPECT_GT(unseen, 5000);
  EXPECT_GT(seen_and_changed, 2000);
}

TEST(ObjectEditingRemove, TakesTheLabelOutOfTheTable) {
  Model scene = RingTableBallModel();
  const ObjectCells ring = CellsOf(scene, kRing);
  // A cell of the ball that was taken for the ring, but nearly for the ball: a crumb.
  const uint32_t crumb = CellsOf(scene, kBall).cells[3];
  scene.foam.identity[crumb * kIdentityDim + kRing] = 4;
  const Model removed = Remove(scene, ring);
  ASSERT_EQ(removed.foam.num_classes, 2);
  EXPECT_EQ(removed.labels[0].id, LabelId{11});
  EXPECT_EQ(removed.labels[1].id, LabelId{12});
  for (uint32_t i = 0; i < removed.foam.NumSites(); ++i) {
    if (removed.foam.positions[i] != scene.foam.positions[crumb]) continue;
    EXPECT_EQ(removed.labels[ClassOf(removed.foam, i)].id, LabelId{12});
    EXPECT_GT(Density(removed.foam.raw_density[i]), 100);
  }
}

// Cells around the ring become thin: of its class, or of the ball's, and so do cells behind them.
// With statistics, solid ones that the light passes are haze as well.
TEST(ObjectEditingRemove, TakesTheHazeAroundAndNothingElse) {
  Model scene = RingTableBallModel();
  const size_t n = scene.foam.NumSites();
  scene.statistics.contribution.assign(n, 0.5f);
  scene.statistics.mean_color.assign(n, {0.1f, 0.2f, 0.3f});
  scene.statistics.passed.assign(n, 1.f);
  scene.statistics.stopped.assign(n, 70.f);
  const ObjectCells ring = CellsOf(scene, kRing);
  const Delaunay delaunay = TriangulateModel(scene);
  const CellLabels labels = LabelCells(scene.foam, delaunay);
  std::vector<int> distance(n, -1);  // to the ring, in cells
  std::vector<uint32_t> reached = ring.cells;
  for (const uint32_t i : ring.cells) distance[i] = 0;
  for (size_t k = 0; k < reached.size(); ++k) {
    for (const uint32_t j : delaunay.Neighbors(reached[k])) {
      if (j >= n || distance[j] >= 0 || labels.solid[j]) continue;
      distance[j] = distance[reached[k]] + 1;
      reached.push_back(j);
    }
  }
  // What is to become of a cell: haze that goes, haze that stays, solid haze that goes, a solid
  // crumb that stays.
  enum Kind { kGoes, kStays, kSolidGoes, kCrumb, kNumKinds };
  std::map<Place, Kind> kinds;
  std::vector<uint8_t> is_in_object = labels.solid;
  for (uint32_t i = 0; i < n; ++i) {
    if (distance[i] < 1 || distance[i] > 2) continue;
    const bool is_own = scene.foam.positions[i].x() > 0;
    float* identity = &scene.foam.identity[i * kIdentityDim];
    std::fill_n(identity, kIdentityDim, 0.f);
    identity[is_own ? kRing : kBall] = 3;
    Kind kind = is_own || distance[i] == 1 ? kGoes : kStays;
    // Not so many that those behind them cannot be reached.
    if (is_own && distance[i] == 2 && i % 4 == 0) kind = i % 8 == 0 ? kSolidGoes : kCrumb;
    if (kind == kSolidGoes) scene.statistics.passed[i] = 71;
    scene.foam.raw_density[i] =
        static_cast<float>(RawDensity(kind == kSolidGoes || kind == kCrumb ? 100 : 0.2));
    const Eigen::Vector3f& x = scene.foam.positions[i];
    kinds[{x.x(), x.y(), x.z()}] = kind;
  }
  const Model removed =
      RemoveObjects(scene, delaunay, LabelCells(scene.foam, delaunay), is_in_object, {ring});
  std::array<int, kNumKinds> right = {};
  for (uint32_t i = 0; i < removed.foam.NumSites(); ++i) {
    const Eigen::Vector3f& x = removed.foam.positions[i];
    const auto found = kinds.find({x.x(), x.y(), x.z()});
    if (found == kinds.end()) continue;
    const Kind kind = found->second;
    const bool is_gone = Density<double>(removed.foam.raw_density[i]) < kTransparentDensity;
    EXPECT_EQ(is_gone, kind == kGoes || kind == kSolidGoes) << kind;
    ++right[kind];
  }
  for (const int count : right) EXPECT_GT(count, 20);
}

}  // namespace
}  // namespace semfoam
