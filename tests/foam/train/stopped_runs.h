// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/optim/training_device.h"
#include "foam/train/checkpoint.h"
#include "foam/train/trainer.h"
#include "foam/util/error.h"
#include "foam/util/number_text.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/foam/foam_digest.h"
#include "tests/foam/synthetic_views.h"
#include <gtest/gtest.h>
#include <unistd.h>

// Trainings that stop and go on.
namespace semfoam {

// Everything that a run can do comes to pass in this one.
inline TrainingOptions EventfulRun() {
  TrainingOptions options;
  options.num_rays = 120 * 1024;
  options.rays_per_iteration = 1024;
  options.initial_sites = 100;
  options.final_sites = 300;
  options.sh_degree = 2;
  // So late that the SH degree changes between densifications.
  options.densify_until = 0.6;
  options.densify_events = 4;
  options.position_rate = 0.3;
  // So few cells are larger than the distances are exact.
  options.distance_weight = 3.6e-4;
  return options;
}

inline const SyntheticViews& Views() {
  static const SyntheticViews views(12, 32, 24, /*gloss=*/0.5f, /*knows_distances=*/true);
  return views;
}

inline constexpr int kClasses = 3;

struct Stop {};

class ResumeTest : public testing::Test {
 protected:
  ResumeTest() {
    folder_ = std::filesystem::temp_directory_path() /
              ("semfoam_resume_test" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  ~ResumeTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path PathOf(int64_t iteration) const {
    return folder_ / (std::to_string(iteration) + ".ckpt");
  }

  static TrainingSummary Train(const TrainingOptions& options, TrainingHooks hooks) {
    return TrainFoam(Views(), Views().Seeds(400), kClasses, options, std::move(hooks));
  }

  using MakeDevice = std::function<std::unique_ptr<TrainingDevice>(TrainingState*)>;

  // Trains to the end, with a checkpoint after every iteration.
  TrainingSummary TrainAndSave(const TrainingOptions& options, MakeDevice make_device = nullptr) {
    TrainingHooks hooks;
    hooks.make_device = std::move(make_device);
    hooks.between_iterations = [&](int64_t iteration, const TrainingHooks::Save& save) {
      CheckpointContents contents;
      save(&contents);
      WriteCheckpoint(PathOf(iteration), contents);
    };
    return Train(options, std::move(hooks));
  }

  TrainingSummary Resume(const TrainingOptions& options,
                         int64_t iteration,
                         MakeDevice make_device = nullptr) {
    TrainingHooks hooks;
    hooks.make_device = std::move(make_device);
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

inline void ExpectSame(const TrainingSummary& resumed, const TrainingSummary& whole) {
  EXPECT_EQ(DigestOf(resumed), DigestOf(whole));
  EXPECT_EQ(resumed.last.iteration, whole.last.iteration);
  EXPECT_EQ(resumed.last.rays, whole.last.rays);
  EXPECT_EQ(resumed.segments, whole.segments);
  EXPECT_EQ(resumed.triangulations, whole.triangulations);
  EXPECT_EQ(resumed.late_rays, whole.late_rays);
  EXPECT_EQ(FormatNumber(resumed.explained_contrast), FormatNumber(whole.explained_contrast));
  EXPECT_EQ(resumed.unstable_iterations, whole.unstable_iterations);
  EXPECT_EQ(FormatNumber(resumed.last.held_out_psnr), FormatNumber(whole.last.held_out_psnr));
  EXPECT_EQ(FormatNumber(resumed.last.held_out_miou), FormatNumber(whole.last.held_out_miou));
}

// The sentence of the UserError, if one is thrown.
inline std::string Refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

// What is said of a file that is `good` but for these texts and arrays.
class StateRefusal {
 public:
  StateRefusal(const Checkpoint& good, std::vector<std::string> arrays)
      : good_(good), arrays_(std::move(arrays)) {
    for (const char* group : {"training_options", "state", "guard", "pending"}) {
      if (const auto& values = good.Texts(group); !values.empty()) texts_[group] = values;
    }
  }

  const CheckpointTexts& texts() const { return texts_; }

  std::string Of(const CheckpointTexts& texts,
                 const std::vector<CheckpointContents::Array>& changed,
                 const std::filesystem::path& path,
                 const std::function<void()>& resume) const {
    CheckpointContents contents{texts, changed};
    for (const std::string& name : arrays_) {
      if (std::none_of(
              changed.begin(), changed.end(), [&](const auto& a) { return a.name == name; })) {
        contents.arrays.push_back({name, good_.Array(name)});
      }
    }
    WriteCheckpoint(path, contents);
    return Refusal(resume);
  }

 private:
  const Checkpoint& good_;
  const std::vector<std::string> arrays_;
  CheckpointTexts texts_;
};

inline std::vector<std::string> StateArrays() {
  return {"positions",
          "raw_density",
          "sh",
          "color_gradient",
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
}

}  // namespace semfoam
