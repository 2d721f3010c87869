// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/segment/scene_segments.h"

#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "tests/foam/segment/shown_scenes.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

SceneSegments Segment(const Model& model, double granularity) {
  return FindSceneSegments(model, TriangulateModel(model), granularity);
}

// Intersection over union of the best segment with what is of these kinds, over solid cells in the
// cube.
double BestMatch(const Model& model, const SceneSegments& found, const std::vector<int>& kinds) {
  std::map<int32_t, int64_t> common, all;
  int64_t of_kinds = 0;
  for (size_t i = 0; i < model.foam.NumSites(); ++i) {
    const Eigen::Vector3f& x = model.foam.positions[i];
    const int kind = x.cwiseAbs().maxCoeff() > 1 ? kAir : Table(x);
    const int32_t segment = found.segment_of_cell[i];
    const bool is_wanted = std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
    of_kinds += is_wanted;
    if (segment == kNoSegment) continue;
    ++all[segment];
    common[segment] += is_wanted;
  }
  double best = 0;
  for (const auto& [segment, count] : common) {
    best = std::max(
        best, static_cast<double>(count) / static_cast<double>(of_kinds + all[segment] - count));
  }
  return best;
}

TEST(SceneSegments, FindsWhatStandsOnATable) {
  const Model model = TableModel();
  const SceneSegments found = Segment(model, 0);
  ASSERT_EQ(found.segments.size(), 4u);
  EXPECT_TRUE(found.segments[0].is_plane);
  EXPECT_GT(BestMatch(model, found, {kTop, kLeg}), 0.9);
  EXPECT_GT(BestMatch(model, found, {kBox}), 0.8);
  EXPECT_GT(BestMatch(model, found, {kPost}), 0.8);
  EXPECT_GT(BestMatch(model, found, {kSnowman}), 0.8);
  double shares = 0;
  for (const SceneSegment& segment : found.segments) shares += segment.share;
  EXPECT_NEAR(shares, 1, 0.02);
}

TEST(SceneSegments, CutsFinerOnRequest) {
  const SceneSegments coarse = Segment(TableModel(), 0), fine = Segment(TableModel(), 0.8);
  EXPECT_GT(fine.segments.size(), coarse.segments.size());
}

TEST(SceneSegments, CoverAllMatterAndNoAir) {
  const Model model = TableModel();
  const CellLabels labels = LabelCells(model.foam, TriangulateModel(model));
  const SceneSegments found = Segment(model, 0.5);
  int64_t missed = 0;
  for (size_t i = 0; i < labels.solid.size(); ++i) {
    const bool has_none = found.segment_of_cell[i] == kNoSegment;
    EXPECT_TRUE(labels.solid[i] != 0 || has_none);
    missed += labels.solid[i] != 0 && has_none;
  }
  EXPECT_LE(missed, 5);
}

TEST(SceneSegments, AreTheSameOnAnyNumberOfThreads) {
  const Model model = TableModel();
  const std::vector<int32_t> one = [&] {
    const ThreadLimit limit(1);
    return Segment(model, 0.5).segment_of_cell;
  }();
  for (const int threads : {2, 5}) {
    const ThreadLimit limit(threads);
    EXPECT_EQ(Segment(model, 0.5).segment_of_cell, one) << threads;
  }
}

TEST(SceneSegments, AirHasNone) {
  const Model model = ShownModel(500, [](const Eigen::Vector3f&) { return kAir; });
  EXPECT_TRUE(Segment(model, 0.5).segments.empty());
}

// A model whose sites are these, all of them matter that photos show.
Model ShownMatter(const std::vector<Eigen::Vector3f>& sites) {
  Model model = ModelOf(sites, 0, 0, [](const Eigen::Vector3f&) { return 0; });
  ShowSurfaces(IsAnywhere, &model);
  return model;
}

TEST(SceneSegments, NoCellAndOneHaveNone) {
  EXPECT_TRUE(Segment(ShownMatter({}), 0.5).segments.empty());
  EXPECT_TRUE(Segment(ShownMatter({{0.1f, 0.2f, 0.3f}}), 0.5).segments.empty());
}

TEST(SceneSegments, CellsInAPlaneInARowAndFarAwayAreCounted) {
  std::vector<Eigen::Vector3f> plane, row;
  for (int i = 0; i < 900; ++i) plane.emplace_back(0.05f * (i % 30), 0.05f * (i / 30), 0.f);
  for (int i = 0; i < 60; ++i) row.emplace_back(0.05f * i, 0.f, 0.f);
  std::vector<Eigen::Vector3f> far = plane;
  for (const float distance : {90.f, 1e6f, 1e15f, 1e30f})
    far.emplace_back(distance, -distance, 1.f);
  for (const std::vector<Eigen::Vector3f>& sites : {plane, row, far}) {
    for (const double granularity : {0., 1.}) {
      const SceneSegments found = Segment(ShownMatter(sites), granularity);
      ASSERT_EQ(found.segment_of_cell.size(), sites.size());
      double shares = 0;
      int64_t cells = 0;
      for (const SceneSegment& segment : found.segments) {
        EXPECT_TRUE(segment.share > 0 && segment.share <= 1 + 1e-6);
        shares += segment.share;
        cells += segment.cells;
      }
      EXPECT_LE(shares, 1 + 1e-6);
      EXPECT_EQ(cells,
                std::count_if(found.segment_of_cell.begin(),
                              found.segment_of_cell.end(),
                              [](int32_t s) { return s != kNoSegment; }));
    }
  }
}

TEST(SceneSegments, RaysOfAnyNumberGiveShares) {
  Model model = TableModel();
  const size_t expected = Segment(model, 0).segments.size();
  for (const float rays : {1e-42f, 3e38f}) {
    for (size_t i = 0; i < model.foam.NumSites(); ++i) {
      if (model.statistics.stopped[i] > 0) model.statistics.stopped[i] = rays;
      if (model.statistics.passed[i] > 0) model.statistics.passed[i] = 3e38f;
    }
    const SceneSegments found = Segment(model, 0);
    EXPECT_EQ(found.segments.size(), expected) << rays;
    for (const SceneSegment& segment : found.segments) EXPECT_TRUE(segment.share > 0) << rays;
  }
}

TEST(SceneSegments, TwinSitesAndOneCellOfMatter) {
  Model model =
      ShownModel(500, [](const Eigen::Vector3f& x) { return x.norm() < 0.15f ? 0 : kAir; });
  for (size_t i = 0; i + 1 < model.foam.NumSites(); i += 50) {
    model.foam.positions[i + 1] = model.foam.positions[i];
  }
  const SceneSegments found = Segment(model, 1);
  for (const SceneSegment& segment : found.segments) EXPECT_TRUE(std::isfinite(segment.share));
}

}  // namespace
}  // namespace semfoam
