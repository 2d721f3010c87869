// SPDX-License-Identifier: GPL-3.0-or-later
//
// A training that stops and goes on ends with the same bytes as one that never stopped.
#include "foam/error.h"
#include "foam/number_text.h"
#include "foam/parallel.h"
#include "foam/trainer.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/foam/foam_digest.h"
#include "tests/foam/own_memory_device.h"
#include "tests/foam/synthetic_views.h"
#include <gtest/gtest.h>
#include <unistd.h>

namespace semfoam {
namespace {

// Everything that a run can do comes to pass in this one: see AllEvents.
TrainingOptions EventfulRun() {
  TrainingOptions options;
  options.num_rays = 120 * 1024;
  options.rays_per_iteration = 1024;
  options.initial_sites = 100;
  options.final_sites = 300;
  options.sh_degree = 2;
  options.densify_events = 4;
  options.position_rate = 0.3;
  return options;
}

const SyntheticViews& Views() {
  static const SyntheticViews views(12, 32, 24, /*gloss=*/0.5f);
  return views;
}

constexpr int kClasses = 3;

struct Stop {};

class ResumeTest : public testing::Test {
 protected:
  ResumeTest() {
    folder_ = std::filesystem::temp_directory_path() /
              ("semfoam_resume_test" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  ~ResumeTest() override {
    SetNumThreads(-1);
    std::filesystem::remove_all(folder_);
  }

  std::filesystem::path PathOf(int64_t iteration) const {
    return folder_ / (std::to_string(iteration) + ".ckpt");
  }

  static TrainingSummary Train(const TrainingOptions& options, TrainingHooks hooks) {
    return TrainFoam(Views(), Views().Seeds(400), kClasses, options, std::move(hooks));
  }

  // Trains to the end, with a checkpoint after every iteration.
  TrainingSummary TrainAndSave(const TrainingOptions& options) {
    TrainingHooks hooks;
    hooks.between_iterations = [&](int64_t iteration, const TrainingHooks::Save& save) {
      CheckpointContents contents;
      save(&contents);
      WriteCheckpoint(PathOf(iteration), contents);
    };
    return Train(options, std::move(hooks));
  }

  TrainingSummary Resume(const TrainingOptions& options, int64_t iteration) {
    TrainingHooks hooks;
    hooks.resume_from = std::make_unique<Checkpoint>(PathOf(iteration));
    return Train(options, std::move(hooks));
  }

  std::map<std::string, std::string> StateOf(int64_t iteration) const {
    return Checkpoint(PathOf(iteration)).Texts("state");
  }

  // The iterations before and after those in which this number of the state changes.
  std::set<int64_t> Around(const std::string& number, int64_t num_iterations) const {
    std::set<int64_t> around;
    for (int64_t k = 2; k < num_iterations; ++k) {
      if (StateOf(k - 1).at(number) != StateOf(k).at(number)) around.insert({k - 1, k});
    }
    return around;
  }

  std::filesystem::path folder_;
};

void ExpectSame(const TrainingSummary& resumed, const TrainingSummary& whole) {
  EXPECT_EQ(DigestOf(resumed), DigestOf(whole));
  EXPECT_EQ(resumed.last.iteration, whole.last.iteration);
  EXPECT_EQ(resumed.last.rays, whole.last.rays);
  EXPECT_EQ(resumed.pieces, whole.pieces);
  EXPECT_EQ(resumed.triangulations, whole.triangulations);
  EXPECT_EQ(resumed.late_rays, whole.late_rays);
  EXPECT_EQ(FormatNumber(resumed.explained_contrast), FormatNumber(whole.explained_contrast));
  EXPECT_EQ(resumed.unstable_iterations, whole.unstable_iterations);
  EXPECT_EQ(FormatNumber(resumed.last.held_out_psnr), FormatNumber(whole.last.held_out_psnr));
  EXPECT_EQ(FormatNumber(resumed.last.held_out_miou), FormatNumber(whole.last.held_out_miou));
}

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
  SetNumThreads(1);
  const TrainingSummary whole = TrainAndSave(options);
  for (const int threads : {1, 2, 5}) {
    SetNumThreads(threads);
    for (const int64_t stop : {17, 62}) {
      SCOPED_TRACE(std::to_string(threads) + " threads");
      ExpectSame(Resume(options, stop), whole);
    }
  }
}

// On a device that keeps the state to itself, as a graphics card does: the trainer asks for it
// whenever it looks at it, and hands it back whenever it has changed it.
TEST_F(ResumeTest, EndsWithTheSameBytesOnADeviceWithItsOwnMemory) {
  const TrainingOptions options = EventfulRun();
  const TrainingSummary whole = TrainAndSave(options);
  TrainingHooks hooks;
  hooks.make_device = MakeOwnMemoryDevice;
  ExpectSame(Train(options, std::move(hooks)), whole);
  for (const int64_t stop : {17, 62}) {
    SCOPED_TRACE(stop);
    const std::string theirs = StateOf(stop).at("pieces");
    TrainingHooks stopped;
    stopped.make_device = MakeOwnMemoryDevice;
    stopped.between_iterations = [&](int64_t iteration, const TrainingHooks::Save& save) {
      if (iteration < stop) return;
      CheckpointContents contents;
      save(&contents);
      WriteCheckpoint(PathOf(stop), contents);
      throw Stop();
    };
    EXPECT_THROW(Train(options, std::move(stopped)), Stop);
    EXPECT_EQ(StateOf(stop).at("pieces"), theirs);
    TrainingHooks resumed;
    resumed.make_device = MakeOwnMemoryDevice;
    resumed.resume_from = std::make_unique<Checkpoint>(PathOf(stop));
    ExpectSame(Train(options, std::move(resumed)), whole);
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

std::string Refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

TEST_F(ResumeTest, RefusesAnotherRun) {
  TrainingOptions options = EventfulRun();
  options.num_rays = 20 * 1024;
  TrainAndSave(options);
  TrainingOptions other = options;
  other.tv_weight = 3;
  std::string text = Refusal([&] { Resume(other, 10); });
  EXPECT_NE(text.find("--FoamTraining.tv_weight 2, not 3"), std::string::npos) << text;
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
  const std::vector<std::string> arrays = {"positions",
                                           "raw_density",
                                           "sh",
                                           "identity",
                                           "classifier_weight",
                                           "contribution",
                                           "start_cells",
                                           "reports",
                                           "first_moments",
                                           "second_moments",
                                           "steps",
                                           "classifier_first_moments",
                                           "triangulated_positions",
                                           "plane_positions",
                                           "squared_error",
                                           "classifier_bias",
                                           "classifier_second_moments"};
  const auto refusal = [&](const CheckpointTexts& texts,
                           const std::vector<CheckpointContents::Array>& changed) {
    CheckpointContents contents{texts, changed};
    for (const std::string& name : arrays) {
      if (std::none_of(
              changed.begin(), changed.end(), [&](const auto& a) { return a.name == name; })) {
        contents.arrays.push_back({name, good.Array(name)});
      }
    }
    WriteCheckpoint(folder_ / "1000.ckpt", contents);
    return Refusal([&] { Resume(options, 1000); });
  };
  CheckpointTexts texts;
  for (const char* group : {"training_options", "state", "guard"}) texts[group] = good.Texts(group);
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
