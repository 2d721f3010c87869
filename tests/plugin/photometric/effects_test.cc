// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/effects.h"

#include "foam/optim/optimizer.h"
#include "foam/train/trainer.h"
#include "foam/util/parallel.h"

#include <cmath>
#include <filesystem>
#include <map>
#include <memory>

#include "tests/foam/synthetic_views.h"
#include "tests/plugin/photo/changed_photos.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;

const fs::path kTabletop = fs::path(SEMFOAM_TEST_DATA) / "tabletop";

SceneOptions OptionsFor(const fs::path& workspace) {
  SceneOptions options;
  options.image_path = workspace / "images";
  options.input_path = workspace / "sparse/0";
  options.test_every = 8;
  return options;
}

const TrainingScene& Tabletop() {
  static const TrainingScene scene(PlanScene(OptionsFor(kTabletop)));
  return scene;
}

const SceneEffects& TabletopEffects() {
  static const SceneEffects effects = ProbeEffects(Tabletop(), {});
  return effects;
}

// The tabletop photographed by another camera.
struct Changed {
  explicit Changed(const CameraHabits& habits)
      : gains(WriteChangedWorkspace(kTabletop, folder / "w", habits)),
        scene(PlanScene(OptionsFor(folder / "w"))) {}

  TempFolder folder;
  std::vector<Eigen::Vector3d> gains;
  TrainingScene scene;
};

Changed& AutomaticCamera() {
  static Changed changed({.exposure = 0.25, .white_balance = 0.05, .falloff = 0.3, .seed = 1});
  return changed;
}

bool IsOn(const SceneEffects& effects, const std::string& name) { return effects.Find(name).on; }

TEST(Effects, NothingIsOnWhereNothingIs) {
  const SceneEffects& effects = TabletopEffects();
  for (const char* name : {"exposure", "white_balance", "vignetting", "distortion", "background"}) {
    EXPECT_FALSE(IsOn(effects, name)) << name << ": " << effects.Find(name).evidence;
    EXPECT_FALSE(effects.Find(name).by_option);
  }
  EXPECT_TRUE(IsOn(effects, "semantics"));
  EXPECT_TRUE(effects.lights.empty());
  EXPECT_LT(effects.Find("exposure").measures.at("bic_gain"), -100);
  EXPECT_LT(effects.Find("white_balance").measures.at("bic_gain"), -100);
}

TEST(Effects, WhatWasPutInIsFound) {
  const Changed& changed = AutomaticCamera();
  const SceneEffects effects = ProbeEffects(changed.scene, {});
  for (const char* name : {"exposure", "white_balance", "vignetting"}) {
    EXPECT_TRUE(IsOn(effects, name)) << name << ": " << effects.Find(name).evidence;
    EXPECT_GT(effects.Find(name).measures.at("bic_gain"), 100) << name;
  }
  EXPECT_NEAR(effects.Find("vignetting").measures.at("corner_light"), 0.7, 0.04);
  // Gains are known up to a factor in each channel: what the reference is called.
  ASSERT_EQ(effects.lights.size(), changed.gains.size());
  for (const bool held_out : {false, true}) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    std::vector<Eigen::Vector3d> errors;
    for (size_t view = 0; view < changed.gains.size(); ++view) {
      const Eigen::Vector3d error =
          (effects.lights[view].gain.array() / changed.gains[view].array()).log();
      if (!changed.scene.IsHeldOut(static_cast<int>(view))) mean += error / 56;
      if (changed.scene.IsHeldOut(static_cast<int>(view)) == held_out) errors.push_back(error);
    }
    if (held_out) {
      // Of the training photos, whose reference it is.
      mean.setZero();
      for (const Eigen::Vector3d& error : errors) mean += error / errors.size();
    }
    double square = 0;
    for (const Eigen::Vector3d& error : errors) {
      square += (error - mean).squaredNorm() / (3 * errors.size());
    }
    EXPECT_LT(std::sqrt(square), 0.04) << held_out;
  }
}

TEST(Effects, ColoursComeBackToTheReference) {
  Changed& changed = AutomaticCamera();
  const auto mean_difference = [&] {
    // Over training photos, by display values; the factor that the reference may differ by is small
    // beside 25 %.
    double sum = 0;
    int64_t count = 0;
    for (int view = 1; view < changed.scene.NumViews(); view += 9) {
      for (int y = 0; y < 240; y += 5) {
        for (int x = 0; x < 320; x += 5) {
          TrainingRay ray, original;
          changed.scene.Ray(view, x, y, &ray);
          Tabletop().Ray(view, x, y, &original);
          if (!ray.color.allFinite()) continue;
          sum += (ray.color - original.color).cwiseAbs().mean();
          ++count;
        }
      }
    }
    EXPECT_GT(count, 15'000);
    return sum / count;
  };
  const double before = mean_difference();
  changed.scene.SetLights(ProbeEffects(changed.scene, {}).lights);
  const double after = mean_difference();
  changed.scene.SetLights({});
  EXPECT_GT(before, 0.04);
  EXPECT_LT(after, 0.25 * before);
  EXPECT_EQ(mean_difference(), before);
}

TEST(Effects, VignettingAloneIsVignettingAlone) {
  const Changed changed({.falloff = 0.2});
  const SceneEffects effects = ProbeEffects(changed.scene, {});
  EXPECT_TRUE(IsOn(effects, "vignetting"));
  EXPECT_FALSE(IsOn(effects, "exposure")) << effects.Find("exposure").evidence;
  EXPECT_FALSE(IsOn(effects, "white_balance"));
  EXPECT_NEAR(effects.Find("vignetting").measures.at("corner_light"), 0.8, 0.04);
}

TEST(Effects, DarkeningOfOneSideIsNoVignetting) {
  const Changed changed({.falloff = 0.3, .is_falloff_below = true});
  const SceneEffects effects = ProbeEffects(changed.scene, {});
  const Effect& vignetting = effects.Find("vignetting");
  EXPECT_FALSE(vignetting.on);
  EXPECT_GT(vignetting.measures.at("bic_gain"), 0);
  EXPECT_LT(vignetting.measures.at("corner_light"), 0.95);
  EXPECT_THAT(vignetting.evidence, HasSubstr("in quarters of the photos"));
  EXPECT_GT(vignetting.measures.at("brightest_quarter_light"), 0.97);
  EXPECT_LT(vignetting.measures.at("darkest_quarter_light"), 0.9);

  EffectsOptions options;
  options.vignetting = EffectSwitch::kOn;
  EXPECT_TRUE(IsOn(ProbeEffects(changed.scene, options), "vignetting"));
}

// The tracks of a thing that stands in the middle of all photos.
TEST(Effects, AThingInTheMiddleTellsNothingOfTheCorners) {
  const TempFolder folder;
  const fs::path workspace = folder / "w";
  WriteChangedWorkspace(kTabletop, workspace, {.falloff = 0.3});
  Reconstruction model = ReadReconstruction(workspace / "sparse/0");
  std::map<uint32_t, const Image*> images;
  for (Image& image : model.images) {
    for (Point2D& point : image.points) {
      const bool is_outside = PlaceInPhoto({point.x, point.y}, 320, 240).squaredNorm() > 0.4;
      if (is_outside) point.point3d_id = kNoPoint3D;
    }
    images[image.id] = &image;
  }
  for (Point3D& point : model.points) {
    std::erase_if(point.track, [&](const TrackElement& seen) {
      return images.at(seen.image_id)->points[seen.point2d_index].point3d_id == kNoPoint3D;
    });
  }
  WriteReconstruction(workspace / "sparse/0", model, ModelFormat::kBinary);
  const TrainingScene scene(PlanScene(OptionsFor(workspace)));
  const SceneEffects effects = ProbeEffects(scene, {});
  const Effect& vignetting = effects.Find("vignetting");
  EXPECT_FALSE(vignetting.on);
  EXPECT_EQ(vignetting.measures.at("share_outside"), 0);
  EXPECT_THAT(vignetting.evidence, HasSubstr("0.0 % of the observations"));

  EffectsOptions options;
  options.vignetting = EffectSwitch::kOn;
  EXPECT_TRUE(IsOn(ProbeEffects(scene, options), "vignetting"));
}

TEST(Effects, SmallChangesOfExposureAreFoundAndHaveNoColour) {
  const Changed changed({.exposure = 0.05});
  const SceneEffects effects = ProbeEffects(changed.scene, {});
  EXPECT_TRUE(IsOn(effects, "exposure"));
  EXPECT_FALSE(IsOn(effects, "white_balance")) << effects.Find("white_balance").evidence;
  EXPECT_FALSE(IsOn(effects, "vignetting"));
}

// What a turntable under a fixed lamp does is not for a gain to undo.
TEST(Effects, AMovingLampIsNoExposure) {
  const Changed changed({.exposure = 0.1, .shading = 0.4});
  const SceneEffects effects = ProbeEffects(changed.scene, {});
  EXPECT_FALSE(IsOn(effects, "exposure"));
  EXPECT_FALSE(IsOn(effects, "vignetting"));
  EXPECT_THAT(effects.Find("exposure").evidence, HasSubstr("light moves"));
  EXPECT_GT(effects.Find("exposure").measures.at("shading"), 0.08);
}

TEST(Effects, TheUserHasTheLastWord) {
  EffectsOptions options;
  options.exposure = EffectSwitch::kOff;
  options.vignetting = EffectSwitch::kOff;
  SceneEffects effects = ProbeEffects(AutomaticCamera().scene, options);
  for (const char* name : {"exposure", "white_balance", "vignetting"}) {
    EXPECT_FALSE(IsOn(effects, name)) << name;
    EXPECT_TRUE(effects.Find(name).by_option) << name;
  }
  EXPECT_TRUE(effects.lights.empty());

  options = {};
  options.exposure = EffectSwitch::kOn;
  options.sh_degree = 2;
  options.fixed_sh_degree = true;
  effects = ProbeEffects(Tabletop(), options);
  EXPECT_TRUE(IsOn(effects, "exposure"));
  EXPECT_FALSE(IsOn(effects, "white_balance"));
  EXPECT_EQ(effects.sh_degree, 2);
  ASSERT_EQ(effects.lights.size(), 64u);
  for (const PhotoLight& light : effects.lights) {
    EXPECT_DOUBLE_EQ(light.gain.minCoeff(), light.gain.maxCoeff());
    EXPECT_NEAR(light.gain[0], 1, 0.15);
  }
}

TEST(Effects, ShDegreeStaysWithinThePresets) {
  const int found = TabletopEffects().sh_degree;
  EXPECT_GE(found, 1);
  EffectsOptions options;
  options.sh_degree = found - 1;
  EXPECT_EQ(ProbeEffects(Tabletop(), options).sh_degree, found - 1);
}

TEST(Effects, SameOnAnyNumberOfThreads) {
  const auto probe = [](int threads) {
    const ThreadLimit limit(threads);
    const TrainingScene scene(PlanScene(OptionsFor(kTabletop)));
    EffectsOptions options;
    options.white_balance = EffectSwitch::kOn;
    return ProbeEffects(scene, options);
  };
  const SceneEffects one = probe(1);
  const SceneEffects five = probe(5);
  ASSERT_EQ(one.lights.size(), five.lights.size());
  for (size_t i = 0; i < one.lights.size(); ++i) {
    EXPECT_EQ(one.lights[i].gain, five.lights[i].gain);  // to the bit
  }
  for (size_t i = 0; i < one.effects.size(); ++i) {
    EXPECT_EQ(one.effects[i].measures, five.effects[i].measures);
  }
}

// What it saves in time is told by the benchmark (render/backward_plain).
TEST(Effects, WhatIsOffIsNotInTheFoam) {
  const SyntheticViews views(8, 40, 30);
  const std::vector<SeedPoint> seeds = views.Seeds(500);
  const auto train = [&](int num_classes, int sh_degree, double color_gradient_rate) {
    TrainingOptions options;
    options.color_gradient_rate = color_gradient_rate;
    options.num_rays = 50'000;
    options.rays_per_iteration = 2048;
    options.final_sites = 800;
    options.sh_degree = sh_degree;
    return TrainFoam(views, seeds, num_classes, options, [](const TrainingProgress&) {}).foam;
  };
  const Foam off = train(0, 0, 0), on = train(3, 3, 5e-3);
  const auto floats_per_site = [](const Foam& foam) {
    return (foam.sh.size() + foam.color_gradient.size() + foam.identity.size()) / foam.NumSites();
  };
  EXPECT_EQ(floats_per_site(off), 3);
  EXPECT_EQ(floats_per_site(on), 3 * 16 + kColorGradientDim + kIdentityDim);
  EXPECT_THAT(off.classifier_weight, IsEmpty());
  // Nor in what a step reads and writes of each cell: its place, density and colour (and
  // their change in the cell, and the identity: 77 numbers), padded.
  EXPECT_EQ(FoamOptimizer(off).row().size, 8);
  EXPECT_EQ(FoamOptimizer(on).row().size, 80);
}

TEST(Effects, ScenesWithoutTracksAreToldSo) {
  TempFolder folder;
  fs::copy(kTabletop / "images", folder / "images");
  Reconstruction model = ReadReconstruction(kTabletop / "sparse/0");
  for (Image& image : model.images) image.points.clear();
  for (Point3D& point : model.points) point.track.clear();
  WriteReconstruction(folder / "sparse/0", model, ModelFormat::kBinary);
  const TrainingScene scene(PlanScene(OptionsFor(folder.path())));
  EffectsOptions options;
  options.sh_degree = 2;
  const SceneEffects effects = ProbeEffects(scene, options);
  EXPECT_THAT(effects.Find("exposure").evidence, HasSubstr("0 observations, too few"));
  EXPECT_EQ(effects.sh_degree, 2);
  EXPECT_FALSE(IsOn(effects, "semantics"));
  EXPECT_TRUE(effects.lights.empty());
}

}  // namespace
}  // namespace semfoam
