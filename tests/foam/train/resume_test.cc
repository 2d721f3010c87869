// SPDX-License-Identifier: GPL-3.0-or-later
//
// A training that stops and goes on ends with the same bytes as one that never stopped.
#include <cmath>
#include <filesystem>
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

TEST_F(ResumeTest, EndsWithTheSameBytesWhereverItStopped) {
  const TrainingOptions options = EventfulRun();
  TrainingHooks none;
  const TrainingSummary plain = Train(options, std::move(none));
  const TrainingSummary whole = TrainAndSave(options);
  ExpectSame(whole, plain);  // Saving changes nothing.

  const int64_t n = whole.last.iteration;
  ASSERT_EQ(n, 120);
  const std::set<int64_t> densified = Around("densifications", n), degree = Around("sh_degree", n),
                          settled = Around("sh_degree_is_settled", n), frozen = Around("frozen", n),
                          triangulated = Around("triangulations", n);
  EXPECT_GE(densified.size(), 6u);
  EXPECT_GE(degree.size(), 2u);
  EXPECT_EQ(settled.size(), 2u);
  EXPECT_EQ(frozen.size(), 2u);
  // Also when nothing but their age asks for it.
  EXPECT_GT(triangulated.size(), densified.size() + frozen.size());

  std::set<int64_t> stops = {1, 2, n - 1};
  for (int64_t k = 5; k < n; k += 9) stops.insert(k);
  for (const auto& events : {densified, degree, settled, frozen, triangulated}) {
    stops.insert(events.begin(), events.end());
  }
  for (const int64_t stop : stops) {
    SCOPED_TRACE("stopped after iteration " + std::to_string(stop));
    ExpectSame(Resume(options, stop), whole);
  }
}

TEST_F(ResumeTest, EndsWithTheSameBytesOnAnyNumberOfThreads) {
  const TrainingOptions options = EventfulRun();
  const TrainingSummary whole = [&] {
    const ThreadLimit limit(1);
    return TrainAndSave(options);
  }();
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    for (const int64_t stop : {17, 62}) {
      SCOPED_TRACE(std::to_string(threads) + " threads");
      ExpectSame(Resume(options, stop), whole);
    }
  }
}

// On a device that keeps the state to itself, as a GPU does: the trainer asks for it
// whenever it looks at it, and hands it back whenever it has changed it.
TEST_F(ResumeTest, EndsWithTheSameBytesOnADeviceWithItsOwnMemory) {
  const TrainingOptions options = EventfulRun();
  TrainingHooks none;
  const TrainingSummary plain = Train(options, std::move(none));
  ExpectSame(TrainAndSave(options, MakeOwnMemoryDevice), plain);
  for (const int64_t stop : {17, 62}) {
    SCOPED_TRACE(stop);
    ExpectSame(Resume(options, stop, MakeOwnMemoryDevice), plain);
    ExpectSame(Resume(options, stop), plain);  // the state is the same on any
  }
}

TEST_F(ResumeTest, AdaptsItsViewsAsOftenAsARunThatNeverStopped) {
  const TrainingOptions options = EventfulRun();
  const TrainingSummary whole = [&] {
    TrainingHooks hooks;
    hooks.adapt_views = [](const TrainingHooks::RenderPixels& render) {
      EXPECT_EQ(render({{1, 3, 4}, {2, 5, 6}}).size(), 2u);
    };
    hooks.between_iterations = [&](int64_t iteration, const TrainingHooks::Save& save) {
      CheckpointContents contents;
      save(&contents);
      WriteCheckpoint(PathOf(iteration), contents);
    };
    return Train(options, std::move(hooks));
  }();
  for (const auto& [stop, left] : {std::pair(17, 3), std::pair(18, 2), std::pair(119, 0)}) {
    int calls = 0;
    TrainingHooks hooks;
    hooks.resume_from = std::make_unique<Checkpoint>(PathOf(stop));
    hooks.adapt_views = [&](const TrainingHooks::RenderPixels&) { ++calls; };
    ExpectSame(Train(options, std::move(hooks)), whole);
    EXPECT_EQ(calls, left) << stop;
  }
}

// Many stops in a row; what is written is the state itself, and not what led to it.
TEST_F(ResumeTest, GoesOnFromARunThatWentOn) {
  const TrainingOptions options = EventfulRun();
  const TrainingSummary whole = TrainAndSave(options);
  int64_t at = 10;
  while (at + 11 < whole.last.iteration) {
    TrainingHooks hooks;
    hooks.resume_from = std::make_unique<Checkpoint>(PathOf(at));
    hooks.between_iterations = [&](int64_t iteration, const TrainingHooks::Save& save) {
      if (iteration < at + 11) return;
      CheckpointContents contents;
      save(&contents);
      WriteCheckpoint(folder_ / "again.ckpt", contents);
      throw Stop();
    };
    EXPECT_THROW(Train(options, std::move(hooks)), Stop);
    at += 11;
    std::filesystem::rename(folder_ / "again.ckpt", PathOf(at));
  }
  ExpectSame(Resume(options, at), whole);
}

TEST_F(ResumeTest, KeepsTheReportsAndTheSeconds) {
  TrainingOptions options = EventfulRun();
  options.num_rays = 40 * 1024;
  const TrainingSummary whole = TrainAndSave(options);
  ASSERT_FALSE(whole.log.empty());
  auto state = StateOf(20);
  const double seconds = std::stod(state.at("seconds"));
  EXPECT_GT(seconds, 0);
  const TrainingSummary resumed = Resume(options, 20);
  EXPECT_GE(resumed.last.seconds, seconds);
  EXPECT_EQ(resumed.log.back().iteration, 40);
  // The mean since the last report, that is, over iterations of both runs.
  if (whole.log.size() == 1 && resumed.log.size() == 1) {
    EXPECT_EQ(resumed.last.color_loss, whole.last.color_loss);
    EXPECT_EQ(resumed.last.tv_loss, whole.last.tv_loss);
  }
  const auto reports = std::stoul(state.at("reports"));
  ASSERT_LE(reports, resumed.log.size());
  for (size_t i = 0; i < reports; ++i) {
    EXPECT_EQ(resumed.log[i].seconds, whole.log[i].seconds);
    EXPECT_EQ(resumed.log[i].iteration, whole.log[i].iteration);
  }
}

// The schedule that was chosen for the seconds is in the checkpoint, before and after the choice.
TEST_F(ResumeTest, KeepsTheScheduleThatSecondsHaveChosen) {
  TrainingOptions options = EventfulRun();
  options.num_rays = 60 * 1024;
  options.seconds = 1e-6;
  const TrainingSummary whole = TrainAndSave(options);
  EXPECT_GT(whole.late_rays, 0);
  EXPECT_LT(whole.last.iteration, 60);
  for (const int64_t stop : {20, 35, 37}) {
    SCOPED_TRACE(stop);
    ExpectSame(Resume(options, stop), whole);
  }
}

TEST_F(ResumeTest, TrainsWithoutClasses) {
  TrainingOptions options = EventfulRun();
  options.num_rays = 40 * 1024;
  TrainingHooks hooks;
  hooks.between_iterations = [&](int64_t iteration, const TrainingHooks::Save& save) {
    if (iteration != 23) return;
    CheckpointContents contents;
    save(&contents);
    WriteCheckpoint(PathOf(iteration), contents);
  };
  const TrainingSummary whole =
      TrainFoam(Views(), Views().Seeds(400), 0, options, std::move(hooks));
  TrainingHooks resume;
  resume.resume_from = std::make_unique<Checkpoint>(PathOf(23));
  ExpectSame(TrainFoam(Views(), Views().Seeds(400), 0, options, std::move(resume)), whole);
}

TEST_F(ResumeTest, RefusesAnotherRun) {
  TrainingOptions options = EventfulRun();
  options.num_rays = 20 * 1024;
  TrainAndSave(options);
  TrainingOptions other = options;
  other.tv_weight = 3;
  std::string text = Refusal([&] { Resume(other, 10); });
  EXPECT_NE(text.find("with tv_weight 2, not 3"), std::string::npos) << text;
  other = options;
  other.random_seed = 7;
  text = Refusal([&] { Resume(other, 10); });
  EXPECT_NE(text.find("random_seed 0, not 7"), std::string::npos) << text;
  text = Refusal([&] {
    TrainingHooks hooks;
    hooks.resume_from = std::make_unique<Checkpoint>(PathOf(10));
    TrainFoam(Views(), Views().Seeds(400), kClasses + 1, options, std::move(hooks));
  });
  EXPECT_NE(text.find("number of labels of 3, not 4"), std::string::npos) << text;
  text = Refusal([&] {
    TrainingHooks hooks;
    hooks.resume_from = std::make_unique<Checkpoint>(PathOf(10));
    TrainFoam(SyntheticViews(16, 32, 24), {}, kClasses, options, std::move(hooks));
  });
  EXPECT_NE(text.find("number of photos of 12, not 16"), std::string::npos) << text;
}

// A file that is whole but whose state is not one.
TEST_F(ResumeTest, RefusesAStateThatCannotBe) {
  TrainingOptions options = EventfulRun();
  options.num_rays = 20 * 1024;
  TrainAndSave(options);
  const Checkpoint good(PathOf(10));
  const std::vector<std::string> arrays = StateArrays();
  const StateRefusal refusals(good, arrays);
  const auto refusal = [&](const CheckpointTexts& texts,
                           const std::vector<CheckpointContents::Array>& changed) {
    return refusals.Of(texts, changed, PathOf(1000), [&] { Resume(options, 1000); });
  };
  const CheckpointTexts& texts = refusals.texts();
  EXPECT_EQ(refusal(texts, {}), "") << "the untouched state is refused";
  for (const std::string& name : arrays) {
    const auto bytes = good.Array(name);
    if (bytes.empty()) continue;
    EXPECT_NE(refusal(texts, {{name, bytes.first(bytes.size() - 1)}}).find("another length"),
              std::string::npos)
        << name;
  }
  const auto positions = good.Array("positions");
  std::vector<std::byte> bytes(positions.begin(), positions.end());
  auto* floats = reinterpret_cast<float*>(bytes.data());
  floats[4] = NAN;
  EXPECT_NE(refusal(texts, {{"positions", bytes}}).find("not finite"), std::string::npos);
  floats[4] = 200;
  EXPECT_NE(refusal(texts, {{"positions", bytes}}).find("out of bounds"), std::string::npos);
  const std::pair<const char*, const char*> bad[] = {{"sites", "18446744073709551615"},
                                                     {"sites", "-1"},
                                                     {"sh_degree", "3"},
                                                     {"iteration", "20"},
                                                     {"iteration", "x"},
                                                     {"frozen", "2"},
                                                     {"reports", "1e3"},
                                                     {"classes", "70000"}};
  for (const auto& [name, value] : bad) {
    CheckpointTexts changed = texts;
    changed["state"][name] = value;
    EXPECT_NE(refusal(changed, {}), "") << name << " " << value;
    changed["state"].erase(name);
    EXPECT_NE(refusal(changed, {}), "") << "without " << name;
  }
}

}  // namespace
}  // namespace semfoam
