// SPDX-License-Identifier: GPL-3.0-or-later
//
// Trainings of blocks of space, and what is joined of them.
#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/optim/initialization.h"
#include "foam/train/block_checkpoint.h"
#include "foam/train/checkpoint_state.h"
#include "foam/train/space_blocks.h"

#include <algorithm>
#include <limits>
#include <tuple>

#include "tests/foam/train/stopped_runs.h"

namespace semfoam {
namespace {

constexpr int64_t kSplit = 50, kMerge = 96;

class BlockTest : public ResumeTest {
 protected:
  BlockTest() { TrainWhole(0); }

  // Trains the whole run, with a checkpoint where it can be split, and splits it.
  void TrainWhole(uint64_t seed) {
    options_.random_seed = seed;
    split_iteration_ = 0;
    TrainingHooks hooks;
    hooks.between_iterations = [&](int64_t iteration, const TrainingHooks::Save& save) {
      if (iteration < kSplit || split_iteration_ > 0) return;
      CheckpointContents contents;
      save(&contents);
      if (!CanBeSplit(contents)) return;
      split_iteration_ = iteration;
      WriteCheckpoint(folder_ / "split.ckpt", contents);
    };
    whole_ = Train(options_, std::move(hooks));
    split_ = std::make_unique<Checkpoint>(folder_ / "split.ckpt");
    const Foam foam = FoamOf(*split_);
    const DensificationStatistics statistics = StatisticsOf(*split_);
    const ViewRenderer renderer(foam);
    boxes_ = SplitSpace(foam.positions, ExpectedSites(statistics, options_.final_sites), 2, 2);
    halo_ =
        HaloWidth(foam, CellRadii(WithGuardSites(foam.positions), renderer.delaunay()), statistics);
    rays_ = ChooseRays(Views(), renderer, boxes_, halo_);
  }

  TrainingOptions BlockOptions() const { return OptionsOfBlock(options_, options_.final_sites); }

  std::filesystem::path StartOf(size_t block) const {
    return folder_ / ("start" + std::to_string(block) + ".ckpt");
  }

  void WriteStart(size_t block) const {
    BlockTraining training{boxes_[block], halo_, rays_[block], Views().Seeds(400), BlockOptions()};
    WriteCheckpoint(StartOf(block), BlockStart(*split_, Views(), training).contents);
  }

  // Trains a block from its start, or from `from`, and returns its result. Also leaves a checkpoint
  // of `halfway` in the folder.
  std::unique_ptr<const Checkpoint> TrainBlock(size_t block,
                                               const std::filesystem::path& from,
                                               int64_t halfway = 0) const {
    const auto path = folder_ / ("block" + std::to_string(block) + ".ckpt");
    TrainingHooks hooks;
    hooks.resume_from = std::make_unique<Checkpoint>(from);
    const std::vector<SeedPoint> seeds = SeedsOf(Checkpoint(StartOf(block)));
    hooks.between_iterations = [&](int64_t iteration, const TrainingHooks::Save& save) {
      CheckpointContents contents;
      save(&contents);
      if (iteration == halfway) WriteCheckpoint(PathOf(iteration), contents);
      if (iteration < kMerge) return;
      WriteCheckpoint(path, BlockResult(contents, boxes_[block], split_iteration_).contents);
      throw Stop();
    };
    EXPECT_THROW(TrainFoam(Views(), seeds, kClasses, BlockOptions(), std::move(hooks)), Stop);
    return std::make_unique<const Checkpoint>(path);
  }

  // Trains the end of the run, from the blocks' results.
  TrainingSummary Merge(const std::vector<const Checkpoint*>& blocks) const {
    WriteCheckpoint(folder_ / "joined.ckpt", JoinBlocks(*split_, blocks).contents);
    TrainingHooks hooks;
    hooks.resume_from = std::make_unique<Checkpoint>(folder_ / "joined.ckpt");
    return Train(options_, std::move(hooks));
  }

  TrainingOptions options_ = EventfulRun();
  TrainingSummary whole_;
  int64_t split_iteration_ = 0;
  std::unique_ptr<Checkpoint> split_;
  std::vector<BlockBox> boxes_;
  std::vector<BlockRays> rays_;
  float halo_ = 0;
};

template <typename T>
std::vector<T> ArrayOf(const Checkpoint& checkpoint, const std::string& name) {
  const auto bytes = checkpoint.Array(name);
  const auto* values = reinterpret_cast<const T*>(bytes.data());
  return {values, values + bytes.size() / sizeof(T)};
}

TEST_F(BlockTest, BoxesHoldEverySiteOnceAndAboutAsMany) {
  const Foam foam = FoamOf(*split_);
  ASSERT_EQ(boxes_.size(), 4u);
  std::vector<size_t> sites(boxes_.size(), 0);
  for (const Eigen::Vector3f& position : foam.positions) {
    int found = 0;
    for (size_t b = 0; b < boxes_.size(); ++b) {
      found += boxes_[b].Contains(position);
      sites[b] += boxes_[b].Contains(position);
    }
    EXPECT_EQ(found, 1) << position.transpose();
  }
  for (const size_t own : sites) {
    EXPECT_GT(own, foam.NumSites() / 8);
    EXPECT_LT(own, foam.NumSites() / 2);
  }
  // Far away, too.
  for (const float x : {-1e6f, 1e6f}) {
    const Eigen::Vector3f far(x, -x, x);
    EXPECT_EQ(
        std::count_if(
            boxes_.begin(), boxes_.end(), [&](const BlockBox& box) { return box.Contains(far); }),
        1);
  }
}

TEST_F(BlockTest, HaloIsSomeLayersOfTheCellsThatWereSeen) {
  DensificationStatistics statistics;
  statistics.contribution.assign(40, 0.f);
  std::vector<float> radii(40, 1.f);
  for (size_t i = 0; i < 10; ++i) {
    statistics.contribution[i] = 0.5f;
    radii[i] = 0.25f;
  }
  Foam foam;
  foam.raw_density.assign(40, kTransparentRawDensity);
  EXPECT_FLOAT_EQ(HaloWidth(foam, radii, statistics), 1);
  // As after a densification.
  statistics.contribution.assign(40, 0.f);
  EXPECT_EQ(HaloWidth(foam, radii, statistics), 0);
  for (size_t i = 20; i < 40; ++i) {
    foam.raw_density[i] = 10;
    radii[i] = 0.5f;
  }
  EXPECT_FLOAT_EQ(HaloWidth(foam, radii, statistics), 2);
}

TEST_F(BlockTest, RaysOfAllBlocksAreThoseOfThePhotosAndSomeMore) {
  // The halos of so few cells would be as wide as the scene.
  const Foam foam = FoamOf(*split_);
  const ViewRenderer renderer(foam);
  const std::vector<BlockRays> of_blocks = ChooseRays(Views(), renderer, boxes_, /*halo=*/0);
  double sum = 0;
  for (const BlockRays& rays : of_blocks) {
    EXPECT_GT(rays.share, 0.1);
    EXPECT_LT(rays.share, 1);
    EXPECT_FALSE(rays.views.empty());
    sum += rays.share;
  }
  EXPECT_GT(sum, 0.9);
  EXPECT_LT(sum, 3.5);
  int pixels = 0, drawn = 0;
  for (int view = 0; view < Views().NumViews(); ++view) {
    if (Views().IsHeldOut(view)) continue;
    for (int y = 0; y < Views().Height(view); ++y) {
      for (int x = 0; x < Views().Width(view); ++x) {
        ++pixels;
        drawn += std::any_of(of_blocks.begin(), of_blocks.end(), [&](const BlockRays& rays) {
          return rays.squares.Contains({view, x, y});
        });
      }
    }
  }
  // All but those where the coarse foam is half transparent.
  EXPECT_GT(drawn, 0.9 * pixels);
}

TEST_F(BlockTest, UntrainedBlocksMakeTheRunThatWasSplit) {
  std::vector<std::unique_ptr<const Checkpoint>> blocks;
  std::vector<const Checkpoint*> pointers;
  for (size_t b = 0; b < boxes_.size(); ++b) {
    WriteStart(b);
    const Checkpoint start(StartOf(b));
    const auto path = folder_ / ("block" + std::to_string(b) + ".ckpt");
    WriteCheckpoint(path, BlockResult(start.Contents(), boxes_[b], split_iteration_).contents);
    blocks.push_back(std::make_unique<const Checkpoint>(path));
    pointers.push_back(blocks.back().get());
  }
  ExpectSame(Merge(pointers), whole_);
}

TEST_F(BlockTest, FrozenSitesStayAndOthersAreTrained) {
  WriteStart(0);
  const Checkpoint start(StartOf(0));
  TrainBlock(0, StartOf(0), kMerge);
  const Checkpoint trained(PathOf(kMerge));
  const auto frozen = ArrayOf<uint8_t>(trained, "is_frozen");
  const auto ancestor = ArrayOf<uint32_t>(trained, "ancestor");
  const Foam before = FoamOf(*split_), after = FoamOf(trained);
  ASSERT_EQ(frozen.size(), after.NumSites());
  size_t num_frozen = 0, num_moved = 0;
  const BlockBox padded = boxes_[0].Padded(halo_);
  for (size_t i = 0; i < after.NumSites(); ++i) {
    const uint32_t a = ancestor[i];
    EXPECT_EQ(frozen[i] != 0, !padded.Contains(before.positions[a]));
    if (!frozen[i]) {
      num_moved += after.positions[i] != before.positions[a];
      continue;
    }
    ++num_frozen;
    EXPECT_EQ(after.positions[i], before.positions[a]);
    EXPECT_EQ(after.raw_density[i], before.raw_density[a]);
    for (int k = 0; k < after.ShStride(); ++k) {
      EXPECT_EQ(after.sh[i * after.ShStride() + k], before.sh[a * after.ShStride() + k]);
    }
    for (int k = 0; k < kIdentityDim; ++k) {
      EXPECT_EQ(after.identity[i * kIdentityDim + k], before.identity[a * kIdentityDim + k]);
    }
  }
  const auto all = ArrayOf<uint8_t>(start, "is_frozen");
  EXPECT_EQ(num_frozen, static_cast<size_t>(std::count(all.begin(), all.end(), 1)));
  EXPECT_GT(num_frozen, 0u);
  EXPECT_LT(all.size(), before.NumSites());
  EXPECT_GT(num_moved, (after.NumSites() - num_frozen) / 2);
  EXPECT_EQ(after.classifier_weight, before.classifier_weight);
  EXPECT_EQ(after.classifier_bias, before.classifier_bias);
  EXPECT_GT(after.NumSites(), all.size());
}

TEST_F(BlockTest, CoarseRunsAreDensifiedBeforeTheyAreSplit) {
  TrainingOptions options = options_;
  options.densify_from = 0.05;
  options.densify_until = 0.3;
  options.densify_events = 10;
  const TrainingOptions coarse = OptionsOfCoarse(options, 120, 0.1);
  EXPECT_EQ(coarse.final_sites, 120);
  EXPECT_LT(coarse.densify_until, 0.1);
  EXPECT_GE(coarse.densify_until, coarse.densify_from);
  EXPECT_EQ(coarse.densify_events, 1);
  EXPECT_LE(coarse.sh_degree_interval * (options.sh_degree + 1), 0.1);
  EXPECT_EQ(coarse.num_rays, options.num_rays);
  EXPECT_EQ(coarse.Check(), "");
  EXPECT_EQ(OptionsOfCoarse(options, 120, 0.24).densify_events, 5);

  const TrainingOptions block = WithDensificationBetween(options, 0.1, 0.8);
  EXPECT_GT(block.densify_from, 0.1);
  EXPECT_FLOAT_EQ(block.densify_until, 0.35f);
  EXPECT_EQ(block.Check(), "");
  EXPECT_FLOAT_EQ(WithDensificationBetween(options, 0.1, 0.2).densify_until, 0.15f);
}

TEST_F(BlockTest, RefiningBlockBeginsWithSitesAtSeeds) {
  BlockTraining training{boxes_[0], halo_, rays_[0], Views().Seeds(400), BlockOptions()};
  training.options.final_sites = 2000;
  training.refines = true;
  WriteCheckpoint(StartOf(0), BlockStart(*split_, Views(), training).contents);
  const Checkpoint start(StartOf(0));
  const Foam before = FoamOf(*split_), foam = FoamOf(start);
  const auto frozen = ArrayOf<uint8_t>(start, "is_frozen");
  const auto ancestor = ArrayOf<uint32_t>(start, "ancestor");
  const auto steps = ArrayOf<uint32_t>(start, "steps");
  const auto first = ArrayOf<float>(start, "first_moments");
  const auto triangulated = ArrayOf<Eigen::Vector3f>(start, "triangulated_positions");
  const size_t num_trained = static_cast<size_t>(std::count(frozen.begin(), frozen.end(), 0));
  ASSERT_EQ(steps.size(), num_trained);
  const size_t stride = first.size() / num_trained;
  const BlockBox padded = boxes_[0].Padded(halo_);
  size_t num_new = 0;
  for (size_t i = 0, m = 0; i < foam.NumSites(); m += !frozen[i++]) {
    if (foam.positions[i] == before.positions[ancestor[i]]) continue;
    ++num_new;
    EXPECT_FALSE(frozen[i]);
    EXPECT_TRUE(padded.Contains(foam.positions[i]));
    EXPECT_EQ(triangulated[i], foam.positions[i]);
    EXPECT_GE(foam.raw_density[i], before.raw_density[ancestor[i]]);
    EXPECT_GE(foam.raw_density[i], RawDensityOfSeed());
    for (int k = 3; k < foam.ShStride(); ++k) EXPECT_EQ(foam.sh[i * foam.ShStride() + k], 0);
    for (int k = 0; k < kIdentityDim; ++k) {
      EXPECT_EQ(foam.identity[i * kIdentityDim + k],
                before.identity[ancestor[i] * kIdentityDim + k]);
    }
    EXPECT_EQ(steps[m], 0u);
    for (size_t k = 0; k < stride; ++k) EXPECT_EQ(first[m * stride + k], 0);
  }
  EXPECT_GT(num_new, 50u);
  const DensificationStatistics statistics = StatisticsOf(start);
  for (size_t i = 0; i < foam.NumSites(); ++i) {
    EXPECT_EQ(statistics.squared_error[i], 0);
    EXPECT_EQ(statistics.contribution[i], frozen[i]);
  }
  EXPECT_EQ(start.Texts("state").at("densifications"), "0");
  EXPECT_EQ(start.Texts("state").at("watched_since"), start.Texts("state").at("iteration"));
}

class ViewsOnGround final : public SyntheticViews {
 public:
  using SyntheticViews::SyntheticViews;
  std::optional<SolidGround> Ground() const override {
    return SolidGround{.level = -0.25f, .radius = 2, .thickness = 0.125f};
  }
};

TEST_F(BlockTest, KnowsTheGroundOfTheRun) {
  WriteStart(1);
  EXPECT_FALSE(GroundOf(Checkpoint(StartOf(1))));
  const ViewsOnGround views(Views().NumViews(), Views().Width(0), Views().Height(0));
  const BlockTraining training{boxes_[1], halo_, rays_[1], views.Seeds(400), BlockOptions()};
  WriteCheckpoint(StartOf(1), BlockStart(*split_, views, training).contents);
  const std::optional<SolidGround> ground = GroundOf(Checkpoint(StartOf(1)));
  ASSERT_TRUE(ground);
  EXPECT_EQ(ground->level, -0.25f);
  EXPECT_EQ(ground->radius, 2);
  EXPECT_EQ(ground->thickness, 0.125f);
}

TEST_F(BlockTest, StoppedBlockEndsWithTheSameBytes) {
  WriteStart(1);
  const auto whole = TrainBlock(1, StartOf(1), (split_iteration_ + kMerge) / 2);
  const auto resumed = TrainBlock(1, PathOf((split_iteration_ + kMerge) / 2));
  for (const std::string name :
       {"positions", "raw_density", "sh", "color_gradient", "identity", "first_moments"}) {
    EXPECT_EQ(ArrayOf<uint8_t>(*whole, name), ArrayOf<uint8_t>(*resumed, name)) << name;
  }
}

// Around its own sites and those of its neighbours, whatever the order, a block keeps what it began
// with.
TEST_F(BlockTest, PolishedBlocksBeginWithTheResultsOfAll) {
  std::vector<std::unique_ptr<const Checkpoint>> results;
  std::vector<size_t> near;
  for (size_t b = 0; b < boxes_.size(); ++b) {
    WriteStart(b);
    results.push_back(TrainBlock(b, StartOf(b)));
    near.push_back(b);
  }
  constexpr size_t kOwn = 1;
  const BlockBox padded = boxes_[kOwn].Padded(halo_);
  const Checkpoint start(StartOf(kOwn));
  WriteCheckpoint(folder_ / "polish.ckpt",
                  PolishStart(start, padded, kOwn, near, [&](size_t b) {
                    return std::make_unique<const Checkpoint>(results[b]->path());
                  }).contents);
  const Checkpoint polish(folder_ / "polish.ckpt");
  const Foam foam = FoamOf(polish), before = FoamOf(start);
  const auto frozen = ArrayOf<uint8_t>(polish, "is_frozen");
  const auto steps = ArrayOf<uint32_t>(polish, "steps");
  // (position, density, steps) of each site that is trained.
  using Site = std::tuple<float, float, float, float, uint32_t>;
  const auto site = [](const Eigen::Vector3f& x, float density, uint32_t steps) {
    return Site(x[0], x[1], x[2], density, steps);
  };
  std::vector<Site> found, expected, kept, kept_expected;
  for (size_t i = 0, m = 0; i < foam.NumSites(); ++i) {
    if (frozen[i]) {
      kept.push_back(site(foam.positions[i], foam.raw_density[i], 0));
    } else {
      found.push_back(site(foam.positions[i], foam.raw_density[i], steps[m++]));
    }
  }
  for (const auto& result : results) {
    const auto positions = ArrayOf<Eigen::Vector3f>(*result, "positions");
    const auto density = ArrayOf<float>(*result, "raw_density");
    const auto steps_of_result = ArrayOf<uint32_t>(*result, "steps");
    for (size_t i = 0; i < positions.size(); ++i) {
      if (!padded.Contains(positions[i])) continue;
      expected.push_back(site(positions[i], density[i], steps_of_result[i]));
    }
  }
  const auto was_frozen = ArrayOf<uint8_t>(start, "is_frozen");
  for (size_t i = 0; i < before.NumSites(); ++i) {
    if (was_frozen[i]) kept_expected.push_back(site(before.positions[i], before.raw_density[i], 0));
  }
  for (auto* sites : {&found, &expected, &kept, &kept_expected}) {
    std::sort(sites->begin(), sites->end());
  }
  EXPECT_EQ(found, expected);
  EXPECT_EQ(kept, kept_expected);
  EXPECT_FALSE(kept.empty());
  const auto ancestor = ArrayOf<uint32_t>(polish, "ancestor");
  EXPECT_TRUE(std::is_sorted(ancestor.begin(), ancestor.end()));

  // It trains to the end, and measures its cells.
  TrainingHooks hooks;
  hooks.resume_from = std::make_unique<Checkpoint>(folder_ / "polish.ckpt");
  hooks.measured_rays = [&](const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) {
    return padded.IsMetBefore(origin, direction, std::numeric_limits<float>::infinity());
  };
  const TrainingSummary polished =
      TrainFoam(Views(), SeedsOf(start), kClasses, BlockOptions(), std::move(hooks));
  EXPECT_EQ(polished.last.iteration, whole_.last.iteration);
  EXPECT_EQ(polished.foam.NumSites(), foam.NumSites());
  double looks = 0;
  for (size_t i = 0; i < foam.NumSites(); ++i) {
    if (!boxes_[kOwn].Contains(polished.foam.positions[i])) continue;
    looks += polished.statistics.passed[i] + polished.statistics.stopped[i];
  }
  EXPECT_GT(looks, 100);
  EXPECT_FALSE(polished.log.empty());
}

// Runs as short as these scatter: the joined ones are worse by 0.7 dB in the mean of ten seeds,
// with a deviation of 0.33 dB.
TEST_F(BlockTest, JoinedBlocksGoOnAsOneRun) {
  constexpr int kSeeds = 8;
  double difference = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    if (seed > 0) TrainWhole(seed);
    std::vector<std::unique_ptr<const Checkpoint>> blocks;
    std::vector<const Checkpoint*> pointers;
    size_t sites = 0;
    for (size_t b = 0; b < boxes_.size(); ++b) {
      WriteStart(b);
      blocks.push_back(TrainBlock(b, StartOf(b)));
      pointers.push_back(blocks.back().get());
      sites += ArrayOf<uint8_t>(*blocks.back(), "is_frozen").size();
    }
    const TrainingSummary merged = Merge(pointers);
    EXPECT_EQ(merged.foam.NumSites(), sites);
    EXPECT_EQ(merged.last.iteration, whole_.last.iteration);
    EXPECT_EQ(merged.step_limit_hits, 0);
    EXPECT_EQ(merged.nonfinite_gradients, 0);
    difference += (merged.last.held_out_psnr - whole_.last.held_out_psnr) / kSeeds;
  }
  EXPECT_GT(difference, -1);
}

TEST_F(BlockTest, RayMeetsABoxBeforeADistance) {
  BlockBox box;
  box.low = {1, -1, -std::numeric_limits<float>::infinity()};
  box.high = {2, 1, 1};
  const Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  EXPECT_TRUE(box.IsMetBefore(origin, {1, 0, 0}, 1.5f));
  EXPECT_FALSE(box.IsMetBefore(origin, {1, 0, 0}, 0.9f));
  EXPECT_FALSE(box.IsMetBefore(origin, {-1, 0, 0}, 10));
  EXPECT_FALSE(box.IsMetBefore(origin, {0, 1, 0}, 10));
  EXPECT_TRUE(box.IsMetBefore({1.5f, 0, 5}, {0, 0, -1}, 10));
  EXPECT_FALSE(box.IsMetBefore({1.5f, 0, 5}, {0, 0, 1}, 10));
  EXPECT_TRUE(BlockBox{}.IsMetBefore(origin, {0, 0, 1}, 1));
}

}  // namespace
}  // namespace semfoam
