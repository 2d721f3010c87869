// SPDX-License-Identifier: GPL-3.0-or-later
//
// Trainings that have every reason to fail: pixels that are no numbers, photos that show nothing,
// learning rates a thousand times too high. Each stops with one sentence that names the iteration
// and the quantity, or ends with a foam of finite numbers that is worth something, and says what it
// left out.
#include "foam/geometry/guard_sites.h"
#include "foam/render/ray_loss.h"
#include "foam/train/trainer.h"
#include "foam/train/training_guard.h"
#include "foam/util/error.h"

#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "tests/foam/repainted_views.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kNumClasses = 3;
const char* const kLostPattern = "Training is lost at iteration [0-9]+: the [^.]+ loss .*";

const RepaintedViews& Room() {
  static const RepaintedViews room([](int, int, int, Eigen::Vector3f*) {});
  return room;
}

RepaintedViews FlatPhotos(float value) {
  return RepaintedViews(
      [value](int, int, int, Eigen::Vector3f* color) { color->setConstant(value); });
}

TrainingOptions SmallRun() {
  TrainingOptions options;
  options.num_rays = 150'000;
  options.rays_per_iteration = 512;
  options.initial_sites = 1000;
  options.final_sites = 3000;
  options.sh_degree = 1;
  options.densify_events = 6;
  return options;
}

void ExpectFinite(const TrainingSummary& summary) {
  const Foam& foam = summary.foam;
  for (const Eigen::Vector3f& p : foam.positions) {
    ASSERT_TRUE(p.allFinite());
    ASSERT_LE(p.norm(), 1.001f * kFarRadius);
  }
  for (const std::span<const float> values :
       std::initializer_list<std::span<const float>>{foam.raw_density,
                                                     foam.sh,
                                                     foam.color_gradient,
                                                     foam.identity,
                                                     foam.classifier_weight,
                                                     foam.classifier_bias,
                                                     summary.statistics.contribution}) {
    for (const float value : values) ASSERT_TRUE(std::isfinite(value));
  }
  for (const Eigen::Vector3f& color : summary.statistics.mean_color) {
    ASSERT_TRUE(color.allFinite());
  }
}

// A run that is not lost; everything in it is finite.
TrainingSummary Train(const RepaintedViews& views,
                      const TrainingOptions& options,
                      int num_classes) {
  const TrainingSummary summary =
      TrainFoam(views, views.room().Seeds(800), num_classes, options, nullptr);
  ExpectFinite(summary);
  EXPECT_EQ(summary.step_limit_hits, 0);
  EXPECT_EQ(summary.nonfinite_gradients, 0);
  return summary;
}

// Why a run is lost; empty if it is not.
std::string ReasonOfLoss(const TrainingOptions& options) {
  try {
    Train(Room(), options, kNumClasses);
    return "";
  } catch (const UserError& error) {
    return error.what();
  }
}

TEST(TrainingHardCases, LeavesOutPixelsThatAreNoNumbersAndCountsThem) {
  const RepaintedViews views([](int, int x, int y, Eigen::Vector3f* color) {
    if (x % 8 == 1) (*color)[y % 3] = NAN;
    if (x % 8 == 4) (*color)[y % 3] = y % 2 == 0 ? kInfinity : -kInfinity;
  });
  const TrainingSummary summary = Train(views, SmallRun(), kNumClasses);
  // A quarter of the columns; every pixel is drawn equally often.
  const double drawn = summary.last.rays + summary.nonfinite_pixels;
  EXPECT_NEAR(summary.nonfinite_pixels / drawn, 0.25, 0.01);
  EXPECT_GT(summary.explained_contrast, 0.7);
  EXPECT_GT(summary.last.held_out_psnr, 15) << "the held-out views have such pixels too";
}

TEST(TrainingHardCases, RefusesPhotosWithoutAnyNumber) {
  TrainingOptions options = SmallRun();
  options.num_rays = 20'000;
  try {
    Train(FlatPhotos(NAN), options, kNumClasses);
    FAIL() << "trained on nothing";
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), HasSubstr("finite colour"));
  }
}

TEST(TrainingHardCases, LearnsBlackAndWhitePhotos) {
  TrainingOptions options = SmallRun();
  // Cells of a colour gradient are black all over a little later.
  options.num_rays = 300'000;
  for (const float value : {0.f, 1.f}) {
    const TrainingSummary summary = Train(FlatPhotos(value), options, kNumClasses);
    EXPECT_GT(summary.last.held_out_psnr, 30) << value;
    EXPECT_EQ(summary.unstable_iterations, 0) << value;
    EXPECT_TRUE(std::isnan(summary.explained_contrast)) << "no contrast, nothing to explain";
  }
}

TEST(TrainingHardCases, NoisePhotosAreNotLostButShowNothing) {
  const RepaintedViews noise([](int view, int x, int y, Eigen::Vector3f* color) {
    CounterRandom random(3, 0x99, (view * 64 + x) * 64 + y);
    for (int c = 0; c < 3; ++c) (*color)[c] = static_cast<float>(random.Uniform());
  });
  const TrainingSummary summary = Train(noise, SmallRun(), kNumClasses);
  EXPECT_EQ(summary.unstable_iterations, 0);
  EXPECT_LT(summary.explained_contrast, 0.1);
}

TEST(TrainingHardCases, HealthyRunsAreNeverLost) {
  // Batch size, rays, seed, classes: five windows of iterations and more, few rays an iteration to
  // many.
  for (const auto& [batch, rays, seed, num_classes] :
       {std::tuple(64, 24'000, 1, kNumClasses), {64, 24'000, 2, 0}, {4096, 1'100'000, 3, 0}}) {
    TrainingOptions options = SmallRun();
    options.rays_per_iteration = batch;
    options.num_rays = rays;
    options.random_seed = seed;
    const TrainingSummary summary = Train(Room(), options, num_classes);
    EXPECT_EQ(summary.unstable_iterations, 0) << batch;
    EXPECT_GT(summary.explained_contrast, 0.5) << batch;
  }
}

struct Excess {
  const char* name;
  double TrainingOptions::*value;
};
constexpr Excess kExcesses[] = {
    {"position_rate", &TrainingOptions::position_rate},
    {"density_rate", &TrainingOptions::density_rate},
    {"color_rate", &TrainingOptions::color_rate},
    {"sh_factor", &TrainingOptions::sh_factor},
    {"color_gradient_rate", &TrainingOptions::color_gradient_rate},
    {"identity_rate", &TrainingOptions::identity_rate},
    {"classifier_rate", &TrainingOptions::classifier_rate},
    {"tv_weight", &TrainingOptions::tv_weight},
    {"color_tv_weight", &TrainingOptions::color_tv_weight},
    {"opacity_weight", &TrainingOptions::opacity_weight},
    {"quantile_weight", &TrainingOptions::quantile_weight},
    {"distance_weight", &TrainingOptions::distance_weight},
    {"identity_weight", &TrainingOptions::identity_weight},
};

TEST(TrainingHardCases, AThousandTimesTooMuchIsLostOrRecovers) {
  for (const Excess& excess : kExcesses) {
    TrainingOptions options = SmallRun();
    options.*excess.value *= 1000;
    try {
      const TrainingSummary summary = Train(Room(), options, kNumClasses);
      EXPECT_GT(summary.explained_contrast, -0.051) << excess.name << ": worse than a flat colour";
      EXPECT_LT(summary.last.identity_loss, 1) << excess.name << ": worse than guessing";
    } catch (const UserError& error) {
      EXPECT_THAT(error.what(), MatchesRegex(kLostPattern)) << excess.name;
    }
  }
}

TEST(TrainingHardCases, AColourRateAThousandTimesTooHighIsLostByTheColourLoss) {
  TrainingOptions options = SmallRun();
  options.color_rate *= 1000;
  const std::string reason = ReasonOfLoss(options);
  EXPECT_THAT(reason, MatchesRegex(kLostPattern));
  EXPECT_THAT(reason, HasSubstr("colour loss"));
}

TEST(TrainingHardCases, TheHighestRatesThatPassTheCheckKeepEveryNumberFinite) {
  TrainingOptions options = SmallRun();
  options.num_rays = 50'000;  // too short to be lost
  for (const Excess& excess : kExcesses) options.*excess.value = 1e6;
  ASSERT_EQ(options.Check(), "");
  try {
    Train(Room(), options, kNumClasses);
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), MatchesRegex(kLostPattern));
  }
  options.position_rate = 1.1e6;
  EXPECT_THAT(options.Check(), HasSubstr("position_rate"));
}

// One iteration of a run as the guard sees it: a hundred rays, half of them black, half white.
struct Iteration {
  std::vector<BatchRay> rays{100};
  BatchTotals batch;
  double tv_loss = 0;
  int64_t skipped = 0;

  Iteration() {
    for (int i = 0; i < 100; ++i) {
      for (float& c : rays[i].target.color) c = static_cast<float>(i % 2);
    }
  }
};

// After how many iterations the guard throws, and what; none if it lets all of them pass.
struct Verdict {
  int iterations;
  std::string reason;
};
std::optional<Verdict> Watch(TrainingGuard* guard,
                             int num_iterations,
                             const std::function<void(int, Iteration*)>& spoil) {
  for (int i = 0; i < num_iterations; ++i) {
    Iteration iteration;
    spoil(i, &iteration);
    try {
      guard->Watch(i, iteration.rays, iteration.batch, iteration.tv_loss, iteration.skipped);
    } catch (const UserError& error) {
      return Verdict{i + 1, error.what()};
    }
  }
  return std::nullopt;
}

TEST(TrainingGuard, ALossThatIsNotFiniteEndsTheRunAtOnce) {
  using Set = std::function<void(Iteration*)>;
  const std::pair<const char*, Set> cases[] = {
      {"the colour loss is not finite", [](Iteration* i) { i->batch.mean_loss.color = NAN; }},
      {"the opacity loss is not finite", [](Iteration* i) { i->batch.mean_loss.opacity = NAN; }},
      {"the quantile loss is not finite",
       [](Iteration* i) { i->batch.mean_loss.quantile = kInfinity; }},
      {"the identity loss is not finite",
       [](Iteration* i) { i->batch.mean_loss.identity = -kInfinity; }},
      {"the distance loss is not finite", [](Iteration* i) { i->batch.mean_loss.distance = NAN; }},
      {"the total variation loss is not finite", [](Iteration* i) { i->tv_loss = NAN; }},
  };
  for (const auto& [reason, set] : cases) {
    TrainingGuard guard;
    const auto verdict = Watch(&guard, 20, [&](int i, Iteration* it) {
      if (i == 7) set(it);
    });
    ASSERT_TRUE(verdict) << reason;
    EXPECT_EQ(verdict->iterations, 8);
    EXPECT_THAT(verdict->reason, HasSubstr("iteration 7: " + std::string(reason)));
  }
}

TEST(TrainingGuard, ManyStepLimitHitsOrSkippedUpdatesEndTheRunFewDoNot) {
  for (const bool step_limit : {true, false}) {
    for (const int per_iteration : {1, 2}) {
      TrainingGuard guard;
      const auto verdict = Watch(&guard, 1000, [&](int, Iteration* it) {
        (step_limit ? it->batch.step_limit_hits : it->skipped) = per_iteration;
      });
      EXPECT_EQ(verdict.has_value(), per_iteration == 2);
      if (verdict) {
        EXPECT_EQ(verdict->iterations, 50);
        EXPECT_THAT(verdict->reason, HasSubstr(step_limit ? "step limit" : "not finite"));
      }
    }
  }
}

// Half black, half white: each pixel differs from a flat picture by a half.
const double kFlatLoss = ColorLoss(0.25);

TEST(TrainingGuard, ALossThatStaysBadEndsTheRun) {
  TrainingGuard guard;
  const auto verdict =
      Watch(&guard, 1000, [](int, Iteration* it) { it->batch.mean_loss.color = 1.21 * kFlatLoss; });
  ASSERT_TRUE(verdict);
  EXPECT_EQ(verdict->iterations, 250) << "a first window to compare with, then four";
  EXPECT_THAT(verdict->reason, HasSubstr("0.0622336, is worse than the 0.0514328"));

  TrainingGuard below;
  EXPECT_FALSE(Watch(
      &below, 1000, [](int, Iteration* it) { it->batch.mean_loss.color = 1.17 * kFlatLoss; }));
  EXPECT_EQ(below.unstable_iterations(), 0);
  EXPECT_NEAR(below.explained_contrast(), 1 - 1.17, 1e-9);

  TrainingGuard identity;
  const auto by_identity =
      Watch(&identity, 1000, [](int, Iteration* it) { it->batch.mean_loss.identity = 2.1; });
  ASSERT_TRUE(by_identity);
  EXPECT_THAT(by_identity->reason, HasSubstr("identity loss"));
}

TEST(TrainingGuard, ALossThatFallsIsGivenTimeButNotBeyondTheEnd) {
  const auto falling = [](int i, Iteration* it) {
    it->batch.mean_loss.color = 10 * std::pow(0.7, i / 50);
  };
  TrainingGuard guard;
  EXPECT_FALSE(Watch(&guard, 1000, falling));
  EXPECT_NO_THROW(guard.Finish(1000));
  TrainingGuard cut_short;
  EXPECT_FALSE(Watch(&cut_short, 300, falling));
  EXPECT_THROW(cut_short.Finish(300), UserError);
  TrainingGuard barely_bad;  // 8 % worse than a flat colour, at the end
  EXPECT_FALSE(Watch(
      &barely_bad, 300, [](int, Iteration* it) { it->batch.mean_loss.color = 1.08 * kFlatLoss; }));
  EXPECT_THROW(barely_bad.Finish(300), UserError);
  TrainingGuard too_short_to_tell;
  EXPECT_FALSE(Watch(&too_short_to_tell, 200, falling));
  EXPECT_NO_THROW(too_short_to_tell.Finish(200));
}

TEST(TrainingGuard, CountsWhatARunRecoveredFrom) {
  TrainingGuard guard;
  EXPECT_FALSE(Watch(&guard, 1000, [](int i, Iteration* it) {
    it->batch.mean_loss.color = i >= 300 && i < 450 ? 2 * kFlatLoss : 0.1 * kFlatLoss;
  }));
  EXPECT_EQ(guard.unstable_iterations(), 150);
  EXPECT_NO_THROW(guard.Finish(1000));
}

}  // namespace
}  // namespace semfoam
