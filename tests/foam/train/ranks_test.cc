// SPDX-License-Identifier: GPL-3.0-or-later
//
// Several processes that train one foam end with the bytes of one process: here threads of this
// one.
#include "foam/device/cpu_device.h"
#include "foam/render/block_exchange.h"
#include "foam/train/trainer.h"
#include "foam/util/rank_group.h"

#include <chrono>
#include <exception>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/foam/rank_threads.h"
#include "tests/foam/train/stopped_runs.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

class RanksTest : public ResumeTest {
 protected:
  static MakeDevice DeviceOf(RankGroup* rank) {
    return [rank](TrainingState* state) { return MakeCpuTrainingDevice(state, rank); };
  }

  // Trains on so many ranks, with the hooks of each. Returns the results of all.
  static std::vector<TrainingSummary> TrainOn(
      int num_ranks,
      const TrainingOptions& options,
      const std::function<void(RankGroup*, TrainingHooks*)>& set_hooks = {}) {
    std::vector<TrainingSummary> summaries(num_ranks);
    RankThreads ranks(num_ranks);
    for (const std::exception_ptr& thrown : ranks.Run([&](RankGroup* rank) {
           TrainingHooks hooks;
           hooks.make_device = DeviceOf(rank);
           if (set_hooks) set_hooks(rank, &hooks);
           summaries[rank->rank()] = Train(options, std::move(hooks));
         })) {
      if (thrown != nullptr) std::rethrow_exception(thrown);
    }
    return summaries;
  }

  static TrainingSummary TrainAlone(const TrainingOptions& options) { return Train(options, {}); }
};

std::string Sentence(const std::exception_ptr& thrown) {
  return Refusal([&] {
    if (thrown != nullptr) std::rethrow_exception(thrown);
  });
}

TEST(BlocksOfRank, AreEachBlockOnceAndEvenlyMany) {
  for (const int64_t num_blocks : {1, 16, 63, 64}) {
    for (const int num_ranks : {1, 2, 3, 5, 64, 100}) {
      int64_t next = 0;
      for (int rank = 0; rank < num_ranks; ++rank) {
        const BlockRange blocks = BlocksOfRank(num_blocks, rank, num_ranks);
        EXPECT_EQ(blocks.first, next);
        EXPECT_GE(blocks.last - blocks.first, num_blocks / num_ranks);
        EXPECT_LE(blocks.last - blocks.first, num_blocks / num_ranks + 1);
        next = blocks.last;
      }
      EXPECT_EQ(next, num_blocks);
    }
  }
}

// Twenty are more than a batch of this run has blocks.
TEST_F(RanksTest, EndWithTheBytesOfOneProcess) {
  const TrainingOptions options = EventfulRun();
  const TrainingSummary alone = TrainAlone(options);
  for (const int num_ranks : {1, 2, 3, 5, 20}) {
    for (const TrainingSummary& summary : TrainOn(num_ranks, options)) {
      SCOPED_TRACE(num_ranks);
      ExpectSame(summary, alone);
    }
  }
}

TEST_F(RanksTest, TrainWithoutClassesAndOnAnyNumberOfThreads) {
  TrainingOptions options = EventfulRun();
  options.num_rays = 40 * 1024;
  const auto train = [&](RankGroup* rank) {
    TrainingHooks hooks;
    hooks.make_device = DeviceOf(rank);
    return TrainFoam(Views(), Views().Seeds(400), 0, options, std::move(hooks));
  };
  const TrainingSummary alone = train(nullptr);
  for (const int threads : {1, 5}) {
    const ThreadLimit limit(threads);
    RankThreads ranks(2);
    for (const auto& thrown : ranks.Run([&](RankGroup* rank) { ExpectSame(train(rank), alone); })) {
      EXPECT_EQ(Sentence(thrown), "");
    }
  }
}

// The clock of rank 1 begins later, so that it has more time left.
TEST_F(RanksTest, HaveTheTimeOfRankZero) {
  TrainingOptions options = EventfulRun();
  options.num_rays = 60 * 1024;
  options.seconds = 0.5;
  const std::vector<TrainingSummary> summaries =
      TrainOn(2, options, [](RankGroup* rank, TrainingHooks*) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100 * rank->rank()));
      });
  EXPECT_GT(summaries[0].late_rays, 0);
  ExpectSame(summaries[1], summaries[0]);
  options.seconds = 0;
  options.late_rays = summaries[0].late_rays;
  ExpectSame(TrainAlone(options), summaries[0]);
}

// One of three ends after so many iterations, before or after the others know of its last one. Rank
// 0 writes a checkpoint, from which any number goes on.
TEST_F(RanksTest, GoOnWithoutALostRank) {
  const TrainingOptions options = EventfulRun();
  const TrainingSummary alone = TrainAlone(options);
  struct Lost {};
  for (const auto& [lost_after, answers] : {std::pair(int64_t{0}, false),
                                            std::pair(int64_t{1}, true),
                                            std::pair(int64_t{37}, true),
                                            std::pair(int64_t{66}, false),
                                            std::pair(int64_t{118}, true)}) {
    SCOPED_TRACE(lost_after);
    int64_t saved = -1;
    RankThreads ranks(3);
    const auto thrown = ranks.Run([&, after = lost_after, last = answers](RankGroup* rank) {
      const bool is_lost = rank->rank() == 1;
      if (is_lost && after == 0) throw Lost();
      TrainingHooks hooks;
      hooks.make_device = DeviceOf(rank);
      hooks.between_iterations = [&](int64_t iteration, const TrainingHooks::Save& save) {
        if (is_lost && iteration == after && !last) throw Lost();
        try {
          rank->Gather({});
        } catch (const LostRank&) {
          if (rank->rank() != 0) throw;
          saved = iteration;
          CheckpointContents contents;
          save(&contents);
          WriteCheckpoint(PathOf(iteration), contents);
          throw;
        }
        if (is_lost && iteration == after) throw Lost();
      };
      Train(options, std::move(hooks));
    });
    ASSERT_EQ(saved, lost_after);
    EXPECT_THROW(std::rethrow_exception(thrown[0]), LostRank);
    EXPECT_THROW(std::rethrow_exception(thrown[2]), LostRank);
    EXPECT_EQ(Sentence(thrown[0]), "Rank 1 was lost.");
    ExpectSame(Resume(options, saved), alone);
    for (const int num_ranks : {2, 5}) {
      const auto resume = [&](RankGroup*, TrainingHooks* hooks) {
        hooks->resume_from = std::make_unique<Checkpoint>(PathOf(saved));
      };
      for (const TrainingSummary& summary : TrainOn(num_ranks, options, resume)) {
        ExpectSame(summary, alone);
      }
    }
  }
}

TEST_F(RanksTest, AreNotTrainedWithDifferentFoams) {
  const TrainingOptions options = EventfulRun();
  RankThreads ranks(3);
  const auto thrown = ranks.Run([&](RankGroup* rank) {
    std::vector<SeedPoint> seeds = Views().Seeds(400);
    for (SeedPoint& seed : seeds) {
      if (rank->rank() == 2) seed.position.x() += 1e-5f;
    }
    TrainingHooks hooks;
    hooks.make_device = DeviceOf(rank);
    TrainFoam(Views(), seeds, kClasses, options, std::move(hooks));
  });
  for (const std::exception_ptr& error : thrown) {
    EXPECT_EQ(Sentence(error),
              "Rank 2 of 3 has other numbers in the same foam than rank 0; the same build on "
              "processors of one kind would be right.");
  }
}

}  // namespace
}  // namespace semfoam
