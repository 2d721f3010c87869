// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/label_spreading.h"

#include "foam/geometry/guard_sites.h"
#include "foam/model/activation.h"
#include "foam/model/classifier.h"
#include "foam/train/trainer.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/foam/random_cells.h"
#include "tests/foam/synthetic_views.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// The graph of these edges: two nodes and a conductance each.
ConductanceGraph GraphOf(uint32_t num_nodes,
                         const std::vector<std::tuple<uint32_t, uint32_t, float>>& edges) {
  ConductanceGraph graph;
  graph.offsets.push_back(0);
  for (uint32_t i = 0; i < num_nodes; ++i) {
    for (const auto& [a, b, conductance] : edges) {
      if (a != i && b != i) continue;
      graph.neighbors.push_back(a == i ? b : a);
      graph.conductance.push_back(conductance);
    }
    graph.offsets.push_back(static_cast<uint32_t>(graph.neighbors.size()));
  }
  return graph;
}

std::vector<IdentityVector> Targets(uint32_t num_nodes) {
  return std::vector<IdentityVector>(num_nodes, IdentityVector::Zero());
}

TEST(LabelSpreading, AChainOfResistorsDividesTheVoltage) {
  // Resistances 1, 2, 1, 4, 2: the ends are held so firmly that they do not give.
  const ConductanceGraph graph =
      GraphOf(6, {{0, 1, 1.f}, {1, 2, 0.5f}, {2, 3, 1.f}, {3, 4, 0.25f}, {4, 5, 0.5f}});
  std::vector<float> hold(6, 0.f);
  hold[0] = hold[5] = kFirmHold;
  std::vector<IdentityVector> target = Targets(6);
  target[0][0] = 1;
  target[5][1] = 1;
  const std::vector<IdentityVector> x = ExtendHarmonically<kIdentityDim>(graph, hold, target);
  const double passed[] = {0, 1, 3, 4, 8, 10};
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(x[i][0], 1 - passed[i] / 10, 1e-4) << i;
    EXPECT_NEAR(x[i][1], passed[i] / 10, 1e-4) << i;
    EXPECT_EQ(x[i][2], 0);
  }
}

TEST(LabelSpreading, AHeldNodeGivesWayInProportionToItsNeighbours) {
  // Node 0 is held by its conductance once, node 1 is fixed: x = (1 * 1 + 0 * 1) / 2.
  const ConductanceGraph graph = GraphOf(2, {{0, 1, 3.f}});
  std::vector<IdentityVector> target = Targets(2);
  target[0][0] = 1;
  const std::vector<IdentityVector> x =
      ExtendHarmonically<kIdentityDim>(graph, {1.f, kFirmHold}, target);
  EXPECT_NEAR(x[0][0], 0.5, 1e-4);
  EXPECT_NEAR(x[1][0], 0, 1e-4);
}

TEST(LabelSpreading, NodesWithoutAWayToATargetAreZero) {
  const ConductanceGraph graph = GraphOf(5, {{0, 1, 1.f}, {2, 3, 1.f}});
  std::vector<IdentityVector> target = Targets(5);
  target[0][4] = 1;
  const std::vector<IdentityVector> x =
      ExtendHarmonically<kIdentityDim>(graph, {1.f, 0.f, 0.f, 0.f, 0.f}, target);
  EXPECT_NEAR(x[1][4], 1, 1e-4);
  for (int i = 2; i < 5; ++i) EXPECT_TRUE(x[i].isZero()) << i;
}

TEST(LabelSpreading, CodesOfClassesAreFarFromEachOther) {
  for (const int num_classes : {1, 13, 16, 17, 200}) {
    const std::vector<IdentityVector> codes = ClassCodes(num_classes);
    ASSERT_EQ(std::ssize(codes), num_classes);
    for (int a = 0; a < num_classes; ++a) {
      EXPECT_NEAR(codes[a].norm(), 1, 1e-5);
      for (int b = 0; b < a; ++b) {
        EXPECT_LT(codes[a].dot(codes[b]), num_classes <= kIdentityDim ? 1e-6 : 0.75);
      }
    }
  }
}

// A slab of opaque cells on a jittered grid, 24 x 8 x 2, grey up to `red_from` in x and red from
// there on, in air, with `num_classes` classes of which all cells have the first.
struct Slab {
  static constexpr int kX = 24, kY = 8, kZ = 2;
  static constexpr int kNumCells = kX * kY * kZ;

  Slab(int red_from, int num_classes) {
    for (int i = 0; i < kNumCells; ++i) {
      AddCell(i % kX, i / kX % kY, i / (kX * kY));
      foam.raw_density.back() = static_cast<float>(RawDensity(500));
      statistics.contribution.back() = 1;
      statistics.mean_color.back() =
          i % kX < red_from ? Eigen::Vector3f(0.5f, 0.5f, 0.5f) : Eigen::Vector3f(0.8f, 0.3f, 0.3f);
    }
    for (int z = -2; z < kZ + 2; ++z) {
      for (int y = -2; y < kY + 2; ++y) {
        for (int x = -2; x < kX + 2; ++x) {
          const bool is_inside = x >= 0 && x < kX && y >= 0 && y < kY && z >= 0 && z < kZ;
          if (!is_inside) AddCell(x, y, z);
        }
      }
    }
    foam.num_classes = num_classes;
    foam.identity.assign(foam.NumSites() * kIdentityDim, 0.f);
    foam.classifier_weight.assign(size_t(num_classes) * kIdentityDim, 0.f);
    foam.classifier_bias.assign(num_classes, 0.f);
    delaunay = Triangulate(WithGuardSites(foam.positions));
  }

  // Adds a cell of air.
  void AddCell(int x, int y, int z) {
    CounterRandom random(3, 0x7e, foam.NumSites());
    foam.positions.push_back(0.1f *
                             (Eigen::Vector3f(x, y, z) + RandomPoint(&random, 0.2).cast<float>()));
    foam.raw_density.push_back(static_cast<float>(RawDensity(1e-4)));
    statistics.contribution.push_back(0);
    statistics.mean_color.push_back(Eigen::Vector3f::Zero());
  }

  static uint32_t Cell(int x, int y, int z) { return x + kX * (y + kY * z); }

  int ClassOf(uint32_t cell) const {
    return FindMostLikelyClass(foam.classifier_weight.data(),
                               foam.classifier_bias.data(),
                               foam.num_classes,
                               &foam.identity[cell * size_t{kIdentityDim}])
        .class_index;
  }

  Foam foam;
  CellStatistics statistics;
  Delaunay delaunay;
};

TEST(LabelSpreading, ColourEdgesStopLabels) {
  // The border of the colours is at 4, that of the middle between the votes at 12.
  Slab slab(/*red_from=*/4, /*num_classes=*/2);
  SpreadLabels(
      slab.delaunay,
      slab.statistics,
      {{Slab::Cell(0, 4, 0), ClassIndex{0}, 100}, {Slab::Cell(23, 4, 0), ClassIndex{1}, 100}},
      &slab.foam);
  int wrong = 0;
  for (int i = 0; i < Slab::kNumCells; ++i) {
    wrong += slab.ClassOf(i) != (i % Slab::kX >= 4);
  }
  EXPECT_EQ(wrong, 0);
}

// Grey, a red strip that a mask shows as the second class, grey again, red again: no mask shows the
// last two. What is farther from any vote than colours can be told apart has the class of its
// colour.
TEST(LabelSpreading, ColoursTellWhereNoMaskIs) {
  Slab slab(/*red_from=*/12, /*num_classes=*/2);
  std::vector<LabelVote> votes;
  for (int i = 0; i < Slab::kNumCells; ++i) {
    const int x = i % Slab::kX;
    if (x >= 4 && x < 8) slab.statistics.mean_color[i] = {0.8f, 0.3f, 0.3f};
    if (x < 8) votes.push_back({uint32_t(i), ClassIndex{x < 4 ? 0 : 1}, 100});
  }
  SpreadLabels(slab.delaunay, slab.statistics, votes, &slab.foam);
  int right = 0, all = 0;
  for (int i = 0; i < Slab::kNumCells; ++i) {
    const int x = i % Slab::kX;
    if (x < 8) {
      EXPECT_EQ(slab.ClassOf(i), x < 4 ? 0 : 1) << x;
    } else {
      ++all;
      right += slab.ClassOf(i) == (x < 12 ? 0 : 1) ? 1 : 0;
    }
  }
  EXPECT_EQ(right, all);
}

// Both ends, which masks show, are grey and red, and all between is of a colour that no mask shows,
// nearer to grey: it tells nothing, so labels meet in the middle.
TEST(LabelSpreading, UnknownColoursTellNothing) {
  Slab slab(/*red_from=*/20, /*num_classes=*/2);
  std::vector<LabelVote> votes;
  for (int i = 0; i < Slab::kNumCells; ++i) {
    const int x = i % Slab::kX;
    if (x >= 4 && x < 20) slab.statistics.mean_color[i] = {0.1f, 0.1f, 0.1f};
    if (x < 4 || x >= 20) votes.push_back({uint32_t(i), ClassIndex{x < 4 ? 0 : 1}, 100});
  }
  SpreadLabels(slab.delaunay, slab.statistics, votes, &slab.foam);
  int second = 0;
  for (int i = 0; i < Slab::kNumCells; ++i) second += slab.ClassOf(i);
  EXPECT_NEAR(second, Slab::kNumCells / 2, Slab::kNumCells / 8);
}

// Where masks show the first class, every other row of it is grey, the rest is red as all of the
// second class is. Red cells on the far side of the first are nearer to it, and stay with it,
// though red is more of the second class's colours.
TEST(LabelSpreading, SharedColoursStayWithTheNearerLabel) {
  // Codes of more classes than an identity has numbers are not orthogonal.
  for (const int num_classes : {2, 3 * kIdentityDim}) {
    Slab slab(/*red_from=*/0, num_classes);
    std::vector<LabelVote> votes;
    for (int i = 0; i < Slab::kNumCells; ++i) {
      const int x = i % Slab::kX, y = i / Slab::kX % Slab::kY;
      if (x >= 10 && x < 16 && y % 2 == 0) slab.statistics.mean_color[i] = {0.5f, 0.5f, 0.5f};
      if (x >= 10) votes.push_back({uint32_t(i), ClassIndex{x < 16 ? 0 : num_classes - 1}, 100});
    }
    SpreadLabels(slab.delaunay, slab.statistics, votes, &slab.foam);
    for (int i = 0; i < Slab::kNumCells; ++i) {
      EXPECT_EQ(slab.ClassOf(i), i % Slab::kX < 16 ? 0 : num_classes - 1) << num_classes;
    }
  }
}

TEST(LabelSpreading, WithoutEdgesLabelsMeetInTheMiddle) {
  Slab slab(/*red_from=*/Slab::kX, /*num_classes=*/2);
  const SpreadingResult result = SpreadLabels(
      slab.delaunay,
      slab.statistics,
      {{Slab::Cell(0, 4, 0), ClassIndex{0}, 100}, {Slab::Cell(23, 4, 0), ClassIndex{1}, 100}},
      &slab.foam);
  int64_t second = 0;
  for (uint32_t i = 0; i < slab.foam.NumSites(); ++i) second += slab.ClassOf(i);
  for (int i = 0; i < Slab::kNumCells; ++i) {
    if (i % Slab::kX < 9) {
      EXPECT_EQ(slab.ClassOf(i), 0) << i;
    }
    if (i % Slab::kX > 14) {
      EXPECT_EQ(slab.ClassOf(i), 1) << i;
    }
  }
  // All had the first class.
  EXPECT_EQ(result.changed_cells, second);
  EXPECT_THAT(result.small_classes, IsEmpty());
}

TEST(LabelSpreading, AirStopsLabels) {
  Slab slab(/*red_from=*/Slab::kX, /*num_classes=*/2);
  // A gap of air at 5 and 6.
  for (int i = 0; i < Slab::kNumCells; ++i) {
    if (i % Slab::kX == 5 || i % Slab::kX == 6) {
      slab.foam.raw_density[i] = static_cast<float>(RawDensity(1e-4));
    }
  }
  SpreadLabels(
      slab.delaunay,
      slab.statistics,
      {{Slab::Cell(0, 4, 0), ClassIndex{0}, 100}, {Slab::Cell(23, 4, 0), ClassIndex{1}, 100}},
      &slab.foam);
  for (int i = 0; i < Slab::kNumCells; ++i) {
    if (i % Slab::kX < 5) {
      EXPECT_EQ(slab.ClassOf(i), 0) << i;
    }
    if (i % Slab::kX > 6) {
      EXPECT_EQ(slab.ClassOf(i), 1) << i;
    }
  }
}

TEST(LabelSpreading, NoVotedClassVanishes) {
  for (const int num_classes : {3, 20}) {
    Slab slab(/*red_from=*/Slab::kX, num_classes);
    std::vector<LabelVote> votes;
    for (uint32_t i = 0; i < Slab::kNumCells; ++i) {
      votes.push_back({i, ClassIndex{0}, 50});
      // Never more than the first class has; the most in cell 70. No mask has the second.
      if (i >= 60 && i < 80) votes.push_back({i, ClassIndex{2}, i == 70 ? 40.f : 20.f});
    }
    const SpreadingResult result = SpreadLabels(slab.delaunay, slab.statistics, votes, &slab.foam);
    EXPECT_THAT(result.small_classes, ElementsAre(ClassIndex{2}));
    EXPECT_EQ(result.changed_cells, 1);
    for (uint32_t i = 0; i < slab.foam.NumSites(); ++i) {
      EXPECT_EQ(slab.ClassOf(i), i == 70 ? 2 : 0) << i;
    }
  }
}

TEST(LabelSpreading, WithoutVotesNothingChanges) {
  Slab slab(/*red_from=*/4, /*num_classes=*/2);
  slab.foam.identity[5] = 1;
  const Foam before = slab.foam;
  EXPECT_EQ(SpreadLabels(slab.delaunay, slab.statistics, {}, &slab.foam).changed_cells, 0);
  EXPECT_EQ(slab.foam.identity, before.identity);
  EXPECT_EQ(slab.foam.classifier_weight, before.classifier_weight);
}

TEST(LabelSpreading, IsTheSameOnAnyNumberOfThreads) {
  std::vector<Foam> foams;
  for (const int num_threads : {1, 2, 5}) {
    const ThreadLimit limit(num_threads);
    Foam foam;
    foam.positions = RandomSites(4000, 9);
    CellStatistics statistics;
    std::vector<LabelVote> votes;
    for (uint32_t i = 0; i < 4000; ++i) {
      CounterRandom random(9, 0x11, i);
      foam.raw_density.push_back(static_cast<float>(RawDensity(50 * random.Uniform())));
      statistics.contribution.push_back(static_cast<float>(random.Uniform()));
      statistics.mean_color.push_back(RandomPoint(&random, 0.5).cast<float>());
      if (i % 10 == 0) votes.push_back({i, ClassIndex{static_cast<int>(random.Below(20))}, 30.f});
    }
    foam.num_classes = 20;
    foam.identity.assign(foam.NumSites() * kIdentityDim, 0.f);
    foam.classifier_weight.assign(20 * kIdentityDim, 0.f);
    foam.classifier_bias.assign(20, 0.f);
    SpreadLabels(Triangulate(WithGuardSites(foam.positions)), statistics, votes, &foam);
    foams.push_back(std::move(foam));
  }
  EXPECT_NE(foams[0].identity[0], 0);
  for (size_t i = 1; i < foams.size(); ++i) {
    EXPECT_EQ(foams[i].identity, foams[0].identity);
    EXPECT_EQ(foams[i].classifier_weight, foams[0].classifier_weight);
  }
}

// The synthetic room, some views of which have labels.
class FewLabels final : public TrainingViews {
 public:
  explicit FewLabels(std::set<int> labelled) : labelled_(std::move(labelled)) {}

  int NumViews() const override { return room_.NumViews(); }
  int Width(int view) const override { return room_.Width(view); }
  int Height(int view) const override { return room_.Height(view); }
  bool IsHeldOut(int view) const override { return room_.IsHeldOut(view); }
  Eigen::Vector3d Origin(int view) const override { return room_.Origin(view); }
  bool HasLabels(int view) const override { return labelled_.contains(view); }
  bool Ray(int view, int x, int y, TrainingRay* ray) const override {
    if (!room_.Ray(view, x, y, ray)) return false;
    if (!HasLabels(view)) ray->class_index = kUnlabelled;
    return true;
  }
  const SyntheticViews& room() const { return room_; }

 private:
  SyntheticViews room_{16, 64, 48};
  std::set<int> labelled_;
};

TEST(LabelSpreading, IsForFewViews) {
  // Of 16 views, 12 are not held out; 0, 4, 8 and 12 are.
  EXPECT_FALSE(FewViewsHaveLabels(FewLabels({})));
  EXPECT_FALSE(FewViewsHaveLabels(FewLabels({0, 4})));
  EXPECT_TRUE(FewViewsHaveLabels(FewLabels({1})));
  EXPECT_TRUE(FewViewsHaveLabels(FewLabels({0, 1, 2, 3, 4, 5, 6})));
  EXPECT_FALSE(FewViewsHaveLabels(FewLabels({1, 2, 3, 5, 6, 7})));
  EXPECT_FALSE(FewViewsHaveLabels(SyntheticViews(16, 64, 48)));
}

TEST(LabelSpreading, VotesAreTheWeightsInTheClassesPixels) {
  const FewLabels few({1, 4, 9});
  Foam foam;
  foam.positions = RandomSites(400, 5);
  for (int i = 0; i < 400; ++i) {
    foam.raw_density.push_back(static_cast<float>(RawDensity(i % 3 == 0 ? 1000 : 1e-4)));
    foam.sh.insert(foam.sh.end(), 3, 0.f);
  }
  const ViewRenderer renderer(foam);
  const std::vector<LabelVote> votes = MeasureLabels(foam, renderer, few, 2);
  ASSERT_FALSE(votes.empty());
  for (size_t k = 1; k < votes.size(); ++k) {
    EXPECT_LT(std::pair(votes[k - 1].cell, votes[k - 1].class_index),
              std::pair(votes[k].cell, votes[k].class_index));
  }
  double sum = 0;
  for (const LabelVote& vote : votes) sum += vote.weight;
  // View 4 is held out, so there are two; opaque cells take nearly all of a ray that meets one.
  double met = 0;
  for (const int view : {1, 9}) {
    const RenderedView rendered = renderer.Render(few.room().Rays(view));
    for (int y = 0; y < rendered.height; y += 2) {
      for (int x = 0; x < rendered.width; x += 2) {
        met += 4 * rendered.opacity[y * rendered.width + x];
      }
    }
  }
  EXPECT_LE(sum, met);
  EXPECT_GT(sum, 0.8 * met);
}

TEST(LabelSpreading, TrainingOnOneMaskLabelsWhatAllViewsShow) {
  TrainingOptions options;
  options.num_rays = 150'000;
  options.rays_per_iteration = 512;
  options.initial_sites = 1000;
  options.final_sites = 3000;
  options.sh_degree = 1;
  options.densify_events = 6;
  const FewLabels views({1});
  const TrainingSummary few =
      TrainFoam(views, views.room().Seeds(800), /*num_classes=*/3, options, nullptr);
  ASSERT_TRUE(few.spreading.has_value());
  EXPECT_THAT(few.spreading->small_classes, IsEmpty());
  const ViewRenderer renderer(few.foam);
  int64_t right = 0, all = 0;
  for (const int view : {0, 4, 8, 12}) {
    const RenderedView rendered = renderer.Render(views.room().Rays(view));
    for (int y = 0; y < rendered.height; ++y) {
      for (int x = 0; x < rendered.width; ++x) {
        TrainingRay ray;
        ASSERT_TRUE(views.room().Ray(view, x, y, &ray));
        right += rendered.class_index[y * rendered.width + x] == ray.class_index;
        ++all;
      }
    }
  }
  EXPECT_GT(double(right) / double(all), 0.9);

  const SyntheticViews labelled(16, 64, 48);
  options.num_rays = 5'000;
  EXPECT_FALSE(TrainFoam(labelled, labelled.Seeds(800), 3, options, nullptr).spreading.has_value());
}

}  // namespace
}  // namespace semfoam
