// SPDX-License-Identifier: GPL-3.0-or-later
//
// Trainings on a device that goes on while sites are triangulated.
#include <cmath>
#include <cstring>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/foam/train/own_memory_device.h"
#include "tests/foam/train/stopped_runs.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using TriangulationLagTest = ResumeTest;

std::unique_ptr<TrainingDevice> MakeDeviceOfLag3(TrainingState* state) {
  return std::make_unique<OwnMemoryDevice>(state, 3);
}

// A triangulation is taken over so many iterations after it was asked for, however long it took; a
// stop in between changes nothing.
TEST_F(TriangulationLagTest, EndsWithTheSameBytesWhereverItStopped) {
  const TrainingOptions options = EventfulRun();
  TrainingHooks none;
  const TrainingSummary at_once = Train(options, std::move(none));
  const TrainingSummary whole = [&] {
    const ThreadLimit limit(1);
    return TrainAndSave(options, MakeDeviceOfLag3);
  }();
  EXPECT_EQ(at_once.triangulation_lag, 0);
  EXPECT_EQ(whole.triangulation_lag, 3);
  EXPECT_NE(DigestOf(whole), DigestOf(at_once));
  EXPECT_EQ(whole.step_limit_hits, 0);
  EXPECT_GT(whole.triangulations, 6);

  // What is under way begins with a plan and ends as planned, three iterations later.
  const int64_t n = whole.last.iteration;
  std::set<int64_t> under_way;
  int densifications = 0, others = 0;
  for (int64_t k = 1; k < n; ++k) {
    const Checkpoint checkpoint(PathOf(k));
    const auto pending = checkpoint.Texts("pending");
    if (pending.empty()) continue;
    under_way.insert(k);
    const int64_t begun = std::stol(pending.at("iteration"));
    EXPECT_LE(begun, k);
    EXPECT_LT(k, begun + 3);
    if (begun != k) continue;
    (pending.at("origins") == "0" ? others : densifications) += 1;
    if (k + 3 >= n) continue;
    EXPECT_EQ(StateOf(k + 2).at("sites"), StateOf(k).at("sites"));
    EXPECT_EQ(StateOf(k + 3).at("sites"), pending.at("sites"));
    EXPECT_EQ(std::stol(StateOf(k + 3).at("triangulations")),
              std::stol(StateOf(k).at("triangulations")) + 1);
    EXPECT_EQ(std::stol(StateOf(k + 3).at("last_triangulation")), k);
    // Of the sites as they were, with planes of where they are.
    const Checkpoint taken_over(PathOf(k + 3));
    const auto bytes = [](const Checkpoint& of, const std::string& array) {
      const auto values = of.Array(array);
      return std::vector<std::byte>(values.begin(), values.end());
    };
    EXPECT_EQ(bytes(taken_over, "triangulated_positions"), bytes(checkpoint, "pending_positions"));
    EXPECT_EQ(bytes(taken_over, "plane_positions"), bytes(taken_over, "positions"));
  }
  EXPECT_EQ(densifications, options.densify_events);
  EXPECT_GE(others, 2);  // as a topology becomes stale, and when positions freeze

  std::set<int64_t> stops;
  for (const int64_t k : under_way) {
    if (k % 2 == 0) stops.insert({k - 1, k});
  }
  for (const int64_t stop : stops) {
    const ThreadLimit limit(stop % 3 == 0 ? 5 : 2);
    SCOPED_TRACE("stopped after iteration " + std::to_string(stop));
    ExpectSame(Resume(options, stop, MakeDeviceOfLag3), whole);
  }
  // On a device that waits for them, one that was under way is taken over, too.
  const TrainingSummary elsewhere = Resume(options, *under_way.begin());
  EXPECT_EQ(elsewhere.last.iteration, n);
  EXPECT_EQ(elsewhere.triangulation_lag, 0);
  // However long a device may take, a run is not all waiting.
  TrainingHooks slow;
  slow.make_device = [](TrainingState* state) {
    return std::make_unique<OwnMemoryDevice>(state, 1000);
  };
  EXPECT_EQ(Train(options, std::move(slow)).triangulation_lag, 72 / 16);
}

// A densification that is late for the triangulation before it does not make the next one judge
// cells that no ray had the time to meet.
TEST_F(TriangulationLagTest, WatchesTheCellsBeforeItDensifiesAgain) {
  TrainingOptions options = EventfulRun();
  options.densify_events = 20;
  const double interval = (options.densify_until - options.densify_from) * 120 / 19;
  ASSERT_LT(interval, 4);  // so the next one is due as soon as the sites have come
  const TrainingSummary summary = TrainAndSave(options, MakeDeviceOfLag3);
  int densifications = 0;
  int64_t sites_came = 0;
  for (int64_t k = 1; k < summary.last.iteration; ++k) {
    const Checkpoint checkpoint(PathOf(k));
    const auto pending = checkpoint.Texts("pending");
    if (pending.empty() || pending.at("origins") == "0") continue;
    if (pending.at("iteration") != std::to_string(k)) continue;
    if (densifications > 0) {
      EXPECT_GE(double(k - sites_came), interval / 2) << k;
    }
    ++densifications;
    sites_came = k + 3;
  }
  EXPECT_EQ(densifications, options.densify_events);
}

// Runs as short as these differ by up to 2.4 dB from seed to seed, so they are compared in the
// mean, which is -0.3 dB with a deviation of 0.25.
TEST_F(TriangulationLagTest, TrainsAsWellInTheMean) {
  constexpr int kSeeds = 16;
  double difference = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    TrainingOptions options = EventfulRun();
    options.random_seed = seed;
    TrainingHooks none, lagging;
    lagging.make_device = MakeDeviceOfLag3;
    difference += Train(options, std::move(lagging)).last.held_out_psnr / kSeeds;
    difference -= Train(options, std::move(none)).last.held_out_psnr / kSeeds;
  }
  EXPECT_GT(difference, -1);
}

// A checkpoint whose triangulation under way, a densification's, is none.
TEST_F(TriangulationLagTest, RefusesATriangulationThatCannotBe) {
  const TrainingOptions options = EventfulRun();
  TrainingHooks hooks;
  hooks.make_device = MakeDeviceOfLag3;
  hooks.between_iterations = [&](int64_t iteration, const TrainingHooks::Save& save) {
    if (iteration < 7) return;
    CheckpointContents contents;
    save(&contents);
    WriteCheckpoint(PathOf(7), contents);
    throw Stop();
  };
  EXPECT_THROW(Train(options, std::move(hooks)), Stop);
  const Checkpoint good(PathOf(7));
  std::vector<std::string> arrays = StateArrays();
  const std::vector<std::string> pending = {
      "pending_positions", "pending_origin", "pending_is_new"};
  arrays.insert(arrays.end(), pending.begin(), pending.end());
  const StateRefusal refusals(good, arrays);
  ASSERT_EQ(refusals.texts().count("pending"), 1u);
  const auto refusal = [&](const CheckpointTexts& texts,
                           const std::vector<CheckpointContents::Array>& changed) {
    return refusals.Of(texts, changed, PathOf(1000), [&] {
      TrainingHooks resumed;
      resumed.make_device = MakeDeviceOfLag3;
      resumed.resume_from = std::make_unique<Checkpoint>(PathOf(1000));
      resumed.between_iterations = [](int64_t, const TrainingHooks::Save&) { throw Stop(); };
      try {
        Train(options, std::move(resumed));
      } catch (const Stop&) {
      }
    });
  };
  EXPECT_EQ(refusal(refusals.texts(), {}), "") << "the untouched state is refused";
  for (const std::string& name : pending) {
    const auto bytes = good.Array(name);
    ASSERT_FALSE(bytes.empty());
    EXPECT_NE(
        refusal(refusals.texts(), {{name, bytes.first(bytes.size() - 1)}}).find("another length"),
        std::string::npos)
        << name;
  }
  const auto spoilt = [&](const std::string& name, auto value) {
    const auto whole = good.Array(name);
    std::vector<std::byte> bytes(whole.begin(), whole.end());
    std::memcpy(bytes.data(), &value, sizeof(value));
    return refusal(refusals.texts(), {{name, bytes}});
  };
  EXPECT_NE(spoilt("pending_positions", NAN).find("not finite"), std::string::npos);
  EXPECT_NE(spoilt("pending_positions", 200.f).find("out of bounds"), std::string::npos);
  EXPECT_NE(spoilt("pending_origin", uint32_t{4'000'000'000}).find("other sites"),
            std::string::npos);
  // All origins gone, as if no site came or went; but other sites are triangulated.
  CheckpointTexts texts = refusals.texts();
  texts["pending"]["origins"] = "0";
  EXPECT_NE(refusal(texts, {{"pending_origin", {}}, {"pending_is_new", {}}}).find("other sites"),
            std::string::npos);
  for (const char* name : {"iteration", "sites", "origins"}) {
    for (const char* value : {"-1", "x", "1000000"}) {
      texts = refusals.texts();
      texts["pending"][name] = value;
      EXPECT_NE(refusal(texts, {}), "") << name << " " << value;
    }
  }
}

}  // namespace
}  // namespace semfoam
