// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/edit/object_insertion.h"

#include "foam/model/classifier.h"
#include "foam/util/error.h"

#include <array>
#include <set>
#include <vector>

#include "tests/foam/edit/object_scenes.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::HasSubstr;
using Place = std::array<float, 3>;

std::set<Place> Places(const Model& model) {
  std::set<Place> places;
  for (const Eigen::Vector3f& x : model.foam.positions) places.insert({x.x(), x.y(), x.z()});
  return places;
}

Insertion Insert(const Model& scene,
                 const ExtractedObjects& objects,
                 const ObjectPlacement& placement = {}) {
  return InsertObjects(scene, TriangulateModel(scene), PlaceObjects(objects, placement, scene));
}

// Ids that a render shows.
std::vector<int32_t> Ids(const Model& model, const RenderedView& view) {
  std::vector<int32_t> ids;
  for (const ClassIndex c : view.class_index) ids.push_back(Value(LabelIdOf(model.labels, c)));
  return ids;
}

// The share of pixels in which two renders show the same label.
double Agreement(const std::vector<int32_t>& a, const std::vector<int32_t>& b) {
  int64_t same = 0;
  for (size_t i = 0; i < a.size(); ++i) same += a[i] == b[i];
  return static_cast<double>(same) / static_cast<double>(a.size());
}

Eigen::Matrix3d QuarterTurn() {
  Eigen::Matrix3d turn;
  turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  return turn;
}

// A world without matter, with hardly a site.
Model EmptyWorld() {
  return ModelOf(FarSites(), 0, 0, [](const Eigen::Vector3f&) { return kAir; });
}

TEST(ObjectInsertion, WhereItWasTakenFromEverythingIsAsItWas) {
  const Model scene = RingTableBallModel();
  const ExtractedObjects ring = Extract(scene, kRing);
  for (const Model& target : {scene, Remove(scene, kRing)}) {
    const Insertion insertion = Insert(target, ring);
    EXPECT_EQ(insertion.num_ring_sites, 0u);  // the scene has them
    EXPECT_EQ(Places(insertion.model), Places(scene));
    EXPECT_EQ(insertion.model.foam.NumSites(), scene.foam.NumSites());
    for (const CameraRays& view : SomeViews()) {
      const RenderedView before = Render(scene, view), after = Render(insertion.model, view);
      EXPECT_LT(LargestDifference(before, after), 1e-4f);
    }
  }
}

TEST(ObjectInsertion, WhatIsAssumedWhereNoPhotoLooksGoes) {
  Model scene = RingTableBallModel();
  const ExtractedObjects ring = Extract(scene, kRing);
  scene.foam.assumed_density.assign(scene.foam.NumSites(), 500.f);
  EXPECT_TRUE(Insert(scene, ring).model.foam.assumed_density.empty());
}

TEST(ObjectInsertion, LabelsAreThoseOfBoth) {
  const Model scene = RingTableBallModel();
  const Insertion insertion = Insert(Remove(scene, kRing), Extract(scene, kRing));
  ASSERT_EQ(insertion.labels.size(), 1u);
  EXPECT_EQ(insertion.labels[0].id, LabelId{10});  // free again
  const Insertion twice = Insert(scene, Extract(scene, kRing), {1, QuarterTurn(), {3, 0, 0}});
  EXPECT_EQ(twice.labels[0].id, LabelId{1});  // 10 is the first ring's
  ASSERT_EQ(twice.model.labels.size(), 4u);
  EXPECT_EQ(twice.model.labels[0].id, LabelId{10});
  // Every cell, and every pixel but on some edges.
  const CellLabels before = LabelCells(scene.foam, TriangulateModel(scene));
  const CellLabels after = LabelCells(insertion.model.foam, TriangulateModel(insertion.model));
  std::multiset<std::pair<Place, int32_t>> cells_before, cells_after;
  const auto list = [](const Model& model, const CellLabels& labels, auto* cells) {
    for (uint32_t i = 0; i < model.foam.NumSites(); ++i) {
      const Eigen::Vector3f& x = model.foam.positions[i];
      if (!labels.solid[i]) continue;
      cells->insert({{x.x(), x.y(), x.z()}, Value(LabelIdOf(model.labels, labels.class_index[i]))});
    }
  };
  list(scene, before, &cells_before);
  list(insertion.model, after, &cells_after);
  EXPECT_EQ(cells_before, cells_after);
  for (const CameraRays& view : SomeViews()) {
    EXPECT_GT(Agreement(Ids(scene, Render(scene, view)),
                        Ids(insertion.model, Render(insertion.model, view))),
              0.98);
  }
}

TEST(ObjectInsertionPlaces, AQuarterTurnLooksAsFromATurnedCamera) {
  const Model scene = RingTableBallModel(3);
  const ExtractedObjects ring = Extract(scene, kRing);
  const Model world = EmptyWorld();
  const Model straight = Insert(world, ring).model;
  const Model turned = Insert(world, ring, {1, QuarterTurn(), {0, 0, 0}}).model;
  EXPECT_EQ(turned.foam.sh_degree, 3);
  for (CameraRays view : SomeViews()) {
    const RenderedView before = Render(straight, view);
    view.origin = QuarterTurn() * view.origin;
    for (Eigen::Vector3f& d : view.directions) d = QuarterTurn().cast<float>() * d;
    const RenderedView after = Render(turned, view);
    EXPECT_LT(LargestDifference(before, after), 1e-4f);
    EXPECT_EQ(before.class_index, after.class_index);
    EXPECT_GT(LargestDifference(before, Render(straight, view)), 0.1f);
  }
}

TEST(ObjectInsertionPlaces, ScaleAndFramesKeepTheOpticalDepth) {
  Model scene = RingTableBallModel();
  for (float& raw : scene.foam.raw_density) {
    if (raw > 0) raw = static_cast<float>(RawDensity(3));  // light comes through
  }
  const ExtractedObjects ring = Extract(scene, kRing);
  Model world = EmptyWorld();
  world.world_from_normalized = {4, {100, 200, 300}};
  // 1.5 times as large in the world is 3 / 8 in the frame of the other scene.
  const ObjectPlacement placement{1.5, QuarterTurn(), {101, 200, 300}};
  const Model inserted = Insert(world, ring, placement).model;
  const Model alone = ring.model;
  for (CameraRays view : SomeViews()) {
    const RenderedView before = Render(alone, view);
    view.origin = world.world_from_normalized.Invert(placement.Apply(view.origin));
    for (Eigen::Vector3f& d : view.directions) d = QuarterTurn().cast<float>() * d;
    const RenderedView after = Render(inserted, view);
    EXPECT_LT(LargestDifference(before, after), 2e-3f);
    const float opaque = *std::max_element(after.opacity.begin(), after.opacity.end());
    EXPECT_GT(opaque, 0.5f);
    EXPECT_LT(opaque, 0.98f);
  }
}

TEST(ObjectInsertionPlaces, FarAwayIsAnError) {
  const Model scene = RingTableBallModel();
  const ExtractedObjects ring = Extract(scene, kRing);
  try {
    PlaceObjects(ring, {1, Eigen::Matrix3d::Identity(), {40, 0, 0}}, scene);
    ADD_FAILURE();
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), HasSubstr("place it nearer, or make it smaller"));
  }
}

// The places of solid cells of a class, as the model shows them.
std::set<Place> SolidPlaces(const Model& model, int32_t id) {
  std::set<Place> places;
  const CellLabels labels = LabelCells(model.foam, TriangulateModel(model));
  for (uint32_t i = 0; i < model.foam.NumSites(); ++i) {
    if (!labels.solid[i] || Value(LabelIdOf(model.labels, labels.class_index[i])) != id) continue;
    const Eigen::Vector3f& x = model.foam.positions[i];
    places.insert({x.x(), x.y(), x.z()});
  }
  return places;
}

TEST(ObjectInsertion, WhatStandsInItsHoleStays) {
  const Model scene = RingTableBallModel();
  const ExtractedObjects ring = Extract(scene, kRing);
  // Other sites, and no ring.
  const Model other = ModelOf(RingTableBallSites(8), 3, 2, [](const Eigen::Vector3f& x) {
    const int k = RingTableBall(x);
    return k == kRing ? kAir : k;
  });
  const Insertion around = Insert(other, ring);
  const std::set<Place> ball = SolidPlaces(other, 12);
  EXPECT_EQ(SolidPlaces(around.model, 12), ball);
  EXPECT_EQ(SolidPlaces(around.model, 10).size(), 0u);
  EXPECT_EQ(around.labels[0].id, LabelId{1});
  const size_t ring_cells = CellsOf(scene, kRing).cells.size();
  EXPECT_EQ(SolidPlaces(around.model, 1).size(), ring_cells);
  EXPECT_GT(around.num_removed, 100u);  // air

  // Moved onto the ball, it is in the ball's place.
  const Insertion onto = Insert(other, ring, {1, QuarterTurn(), {0.5, 0, 0}});
  EXPECT_EQ(SolidPlaces(onto.model, 1).size(), ring_cells);
  const std::set<Place> left = SolidPlaces(onto.model, 12);
  size_t kept = 0;
  for (const Place& place : ball) kept += left.count(place);
  EXPECT_LT(kept, ball.size() * 3 / 4);
}

TEST(ObjectInsertion, AmongOtherCellsItLooksTheSame) {
  const Model scene = RingTableBallModel();
  const ExtractedObjects ring = Extract(scene, kRing);
  const Model air =
      ModelOf(RingTableBallSites(8), 1, 1, [](const Eigen::Vector3f&) { return kAir; });
  const Model inserted = Insert(air, ring, {1, QuarterTurn(), {0, 0, 0}}).model;
  const Model alone = Insert(EmptyWorld(), ring, {1, QuarterTurn(), {0, 0, 0}}).model;
  for (const CameraRays& view : SomeViews()) {
    const RenderedView a = Render(alone, view), b = Render(inserted, view);
    double squared = 0;
    for (size_t i = 0; i < a.color.size(); ++i) squared += (a.color[i] - b.color[i]).squaredNorm();
    EXPECT_GT(-10 * std::log10(squared / (3.0 * a.color.size())), 33);  // PSNR
  }
}

// The number of pixels that do not show label `id` after, and are not as before.
int NumChanged(
    const Model& before, const Model& after, int32_t id, const CameraRays& view, int* num_showing) {
  const RenderedView was = Render(before, view), is = Render(after, view);
  const std::vector<int32_t> ids = Ids(after, is);
  int changed = 0;
  for (size_t i = 0; i < ids.size(); ++i) {
    *num_showing += ids[i] == id;
    changed += ids[i] != id && (is.color[i] - was.color[i]).cwiseAbs().maxCoeff() > 0.05f;
  }
  return changed;
}

TEST(ObjectInsertion, ATableStaysWholeUnderAnObject) {
  const Model scene = RingTableBallModel();
  const Model other = ModelOf(RingTableBallSites(8), 3, 2, [](const Eigen::Vector3f& x) {
    return RingTableBall(x) == kTable ? kTable : kAir;
  });
  const Model laid = Insert(other, Extract(scene, kRing)).model;
  int showing = 0;
  for (const CameraRays& view : SomeViews()) {
    EXPECT_LT(NumChanged(other, laid, 1, view, &showing), 100);  // edges, of 6400 pixels
  }
  EXPECT_GT(showing, 3000);
}

// A table of fine cells under air of large ones, of which an object takes some away.
TEST(ObjectInsertion, SurfacesDoNotGrowIntoWhereAirWas) {
  std::vector<Eigen::Vector3f> sites = FarSites();
  for (const Eigen::Vector3f& x : RandomSites(9000, 3)) {
    if (x.z() < -0.4f) sites.push_back(x);
  }
  for (const Eigen::Vector3f& x : RandomSites(500, 5)) {
    if (x.z() >= -0.4f) sites.push_back(x);
  }
  const Model table = ModelOf(sites, 1, 0, [](const Eigen::Vector3f& x) {
    const bool is_inside = x.head<2>().cwiseAbs().maxCoeff() < 0.8f && x.z() > -0.9f;
    return x.z() < -0.4f && is_inside ? 0 : kAir;
  });
  const ExtractedObjects ball = Extract(RingTableBallModel(0), kBall);
  const ObjectPlacement placement{0.8, Eigen::Matrix3d::Identity(), {0, 0, 0.25}};
  const Insertion insertion = Insert(table, ball, placement);
  EXPECT_GE(insertion.num_removed, 1u);
  EXPECT_GT(insertion.num_ring_sites, 50u);
  int showing = 0;
  for (const CameraRays& view : {LookAt({2.5, 0, 0.3}, {0, 0, -0.1}, {0, 1, 0}, 120),
                                 LookAt({1, 1, 1.5}, {0, 0, -0.1}, {0, 1, 0}, 120)}) {
    EXPECT_LT(NumChanged(table, insertion.model, 12, view, &showing), 20);
  }
  EXPECT_GT(showing, 300);
}

TEST(ObjectInsertion, StatisticsAreAsTheSceneHasThem) {
  Model scene = RingTableBallModel();
  const ExtractedObjects ring = Extract(scene, kRing);
  Model measured = Remove(scene, kRing);
  const size_t n = measured.foam.NumSites();
  measured.statistics.contribution.assign(n, 0.25f);
  measured.statistics.mean_color.assign(n, {0.5f, 0.5f, 0.5f});
  measured.statistics.passed.assign(n, 100.f);
  measured.statistics.stopped.assign(n, 1.f);
  const Insertion insertion = Insert(measured, ring);
  const CellStatistics& statistics = insertion.model.statistics;
  ASSERT_EQ(statistics.contribution.size(), insertion.model.foam.NumSites());
  ASSERT_EQ(statistics.stopped.size(), insertion.model.foam.NumSites());
  for (uint32_t i = 0; i < insertion.model.foam.NumSites(); ++i) {
    const bool is_ring = RingTableBall(insertion.model.foam.positions[i]) == kRing;
    EXPECT_EQ(statistics.contribution[i], is_ring ? 1.f : 0.25f);
    EXPECT_EQ(statistics.passed[i] > statistics.stopped[i], !is_ring);
  }
  // And the other way round: what the scene has not, the model has not.
  const Model bare = Insert(Remove(scene, kRing), Extract(measured, 0)).model;
  EXPECT_TRUE(bare.statistics.contribution.empty());
  EXPECT_TRUE(bare.statistics.passed.empty());
}

TEST(ObjectInsertion, SitesThatFallTogetherAreOneCell) {
  const Model scene = RingTableBallModel();
  const ExtractedObjects ring = Extract(scene, kRing);
  // So small that most of the floats around (8, 8, 8) are the same.
  const ObjectPlacement placement{1e-6, Eigen::Matrix3d::Identity(), {8, 8, 8}};
  const Model inserted = Insert(scene, ring, placement).model;
  EXPECT_LT(inserted.foam.NumSites(), scene.foam.NumSites() + ring.object_of_site.size() / 2);
  EXPECT_EQ(Places(inserted).size(), inserted.foam.NumSites());
  for (const CameraRays& view : SomeViews()) {
    EXPECT_LT(LargestDifference(Render(inserted, view), Render(scene, view)), 1e-4f);
  }
}

}  // namespace
}  // namespace semfoam
