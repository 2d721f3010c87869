// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/light_refinement.h"

#include "foam/image/srgb.h"
#include "foam/train/checkpoint_state.h"
#include "foam/util/parallel.h"
#include "foam/util/random.h"
#include "plugin/photometric/expected_light.h"

#include <cmath>
#include <filesystem>
#include <functional>
#include <vector>

#include "tests/plugin/photo/changed_photos.h"
#include "tests/plugin/photometric/tabletop_photos.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// A foam that shows the tabletop as its unchanged photos do.
std::vector<RenderedRay> RenderOriginal(const std::vector<ViewPixel>& pixels) {
  std::vector<RenderedRay> rendered(pixels.size());
  for (size_t i = 0; i < pixels.size(); ++i) {
    TrainingRay ray;
    if (!Tabletop().Ray(pixels[i].view, pixels[i].x, pixels[i].y, &ray)) continue;
    rendered[i].color = ray.color;
    rendered[i].opacity = 1;
  }
  return rendered;
}

using Renderer = std::vector<RenderedRay>(const std::vector<ViewPixel>&);

// The photos of a scene beside such renders.
std::vector<ComparedView> Compare(const TrainingScene& scene,
                                  const std::function<Renderer>& render) {
  return CompareViews(scene, 100'000, render);
}

// The tabletop photographed in other light.
struct Changed {
  explicit Changed(const CameraHabits& habits)
      : gains(WriteChangedWorkspace(TabletopPath(), folder / "w", habits)),
        scene(PlanScene(PhotosOf(folder / "w"))) {}

  // Root of the mean square of the difference to the unchanged photos' display values, over the
  // training photos, after the factor that is best for each channel of all photos.
  double Difference() const {
    double squares = 0;
    int64_t count = 0;
    for (int view = 1; view < scene.NumViews(); view += 3) {
      if (scene.IsHeldOut(view)) continue;
      for (int y = 0; y < 240; y += 7) {
        for (int x = 0; x < 320; x += 7) {
          TrainingRay ray, original;
          scene.Ray(view, x, y, &ray);
          Tabletop().Ray(view, x, y, &original);
          if (!ray.color.allFinite() || original.color.maxCoeff() > 0.9) continue;
          squares += (ray.color - original.color).squaredNorm() / 3;
          ++count;
        }
      }
    }
    EXPECT_GT(count, 10'000);
    return std::sqrt(squares / count);
  }

  TempFolder folder;
  std::vector<Eigen::Vector3d> gains;
  TrainingScene scene;
};

Eigen::Vector3d Display(const Eigen::Vector3d& light) {
  return {DisplayFromLinear(light[0]), DisplayFromLinear(light[1]), DisplayFromLinear(light[2])};
}

// Pairs under this field, with noise, and a share of them with something else before the surface.
std::vector<LightPair> PairsUnder(const LightField& field, double outliers) {
  std::vector<LightPair> pairs;
  CounterRandom random(3, 0x11, 0);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      LightPair pair;
      pair.place = PlaceInPhoto({x + 0.5, y + 0.5}, 64, 48);
      pair.half = (x / 8 + y / 8) % 2;
      const Eigen::Vector3d light = Eigen::Vector3d::Constant(0.1 + 0.3 * random.Uniform());
      Eigen::Matrix<double, 1 + kNumShadingTerms, 1> terms;
      terms << 1, ShadingTerms(pair.place);
      pair.render = Display(light);
      pair.photo = Display(light.array() * (field * terms).array().exp());
      for (double& value : pair.photo) value += 0.01 * random.Normal();
      if (random.Uniform() < outliers) pair.photo = {0.8, 0.3, 0.1};
      pairs.push_back(pair);
    }
  }
  return pairs;
}

TEST(FitLightField, FindsTheFieldBesideOutliers) {
  LightField field;
  field << 0.2, 0.1, -0.2, 0.1, 0, 0.05, -0.1, 0.2, 0, 0, 0.1, 0, 0, -0.1, 0.1, -0.2, 0, 0.2;
  for (const double outliers : {0.0, 0.2}) {
    const std::vector<LightPair> pairs = PairsUnder(field, outliers);
    for (const int half : {-1, 0, 1}) {
      const LightField found = FitLightField(pairs, 2, half);
      double squares = 0;
      for (const LightPair& pair : pairs) {
        Eigen::Matrix<double, 1 + kNumShadingTerms, 1> terms;
        terms << 1, ShadingTerms(pair.place);
        squares += ((found - field) * terms).squaredNorm() / 3;
      }
      EXPECT_LT(std::sqrt(squares / pairs.size()), outliers > 0 ? 0.05 : 0.005)
          << outliers << " " << half << "\n"
          << found;
    }
  }
  const std::vector<LightPair> pairs = PairsUnder(field, 0);
  // A lower degree has no terms of a higher one.
  EXPECT_TRUE(FitLightField(pairs, 0, -1).rightCols<kNumShadingTerms>().isZero(0));
  EXPECT_TRUE(FitLightField(pairs, 1, -1).rightCols<3>().isZero(0));
}

TEST(FitLightField, KnowsNothingWithoutPixels) {
  EXPECT_TRUE(FitLightField({}, 2, -1).isZero(0));
  LightPair white;
  white.place = {0, 0};
  white.photo = white.render = {1, 1, 1};
  EXPECT_TRUE(FitLightField({white}, 2, -1).isZero(0));
}

TEST(LightRefiner, LeavesUnchangedPhotosAlone) {
  TrainingScene scene(PlanScene(PhotosOf(TabletopPath())));
  LightRefiner refiner(&scene, {}, EffectSwitch::kAuto);
  // A foam that has not learned the details: noise, the same for every seed.
  const auto blurred = [](const std::vector<ViewPixel>& pixels) {
    std::vector<RenderedRay> rendered = RenderOriginal(pixels);
    CounterRandom random(5, 0x12, pixels[0].view);
    for (RenderedRay& ray : rendered) ray.color *= float(1 + 0.1 * random.Normal());
    return rendered;
  };
  refiner.Refine(Compare(scene, blurred));
  EXPECT_TRUE(refiner.IsDecided());
  EXPECT_FALSE(refiner.IsOn()) << refiner.Report();
  EXPECT_TRUE(refiner.lights().empty());
  EXPECT_LT(std::abs(refiner.explained()), 0.01);
  EXPECT_THAT(refiner.Report(), HasSubstr("stays as it is"));
}

TEST(LightRefiner, TakesOutALampThatMoves) {
  Changed changed({.exposure = 0.1, .white_balance = 0.05, .shading = 0.3, .seed = 2});
  const double before = changed.Difference();
  LightRefiner refiner(&changed.scene, {}, EffectSwitch::kAuto);
  refiner.Refine(Compare(changed.scene, RenderOriginal));
  EXPECT_TRUE(refiner.IsOn()) << refiner.Report();
  EXPECT_EQ(refiner.degree(), 1);
  EXPECT_GT(refiner.explained(), 0.8);
  const double after = changed.Difference();
  EXPECT_GT(before, 0.03);
  EXPECT_LT(after, 0.3 * before);
  // Held-out photos are not looked at: theirs is expected from the others.
  const ExpectedLights expected(
      changed.scene.Photos(), changed.scene.Plan().lenses, refiner.lights());
  EXPECT_TRUE(changed.scene.IsHeldOut(0));
  EXPECT_EQ(refiner.lights()[0].gain, expected.OfPhoto(0).gain);
  EXPECT_EQ(refiner.lights()[0].shading, expected.OfPhoto(0).shading);
  EXPECT_NEAR(refiner.lights()[0].gain[0], 1, 0.05);
  // The second time finds the same again, to which nothing is to be added.
  const std::vector<PhotoLight> lights = refiner.lights();
  refiner.Refine(Compare(changed.scene, RenderOriginal));
  EXPECT_NEAR(refiner.lights()[9].gain[0], lights[9].gain[0], 1e-12);
}

TEST(FitTones, FindsContrastAndSaturationOfTwoLenses) {
  // As logarithms: more contrast, and more saturation, which draws channels away from their mean.
  Eigen::Matrix3d more = 1.2 * Eigen::Matrix3d::Identity();
  more.array() -= 0.05;
  const Eigen::Matrix3d less = 2 * Eigen::Matrix3d::Identity() - more;
  LensPairs photos;
  for (int photo = 0; photo < 8; ++photo) {
    photos.lenses.push_back(photo % 2);
    photos.falloffs.push_back({-0.2, 0});
    std::vector<LightPair> pairs;
    CounterRandom random(photo, 0x12, 0);
    const Eigen::Vector3d gain(1 + 0.05 * photo, 1, 1 - 0.03 * photo);
    for (int i = 0; i < 3000; ++i) {
      LightPair pair;
      pair.place = PlaceInPhoto({64 * random.Uniform(), 48 * random.Uniform()}, 64, 48);
      pair.half = i % 2;
      const Eigen::Vector3d light =
          Eigen::Vector3d(random.Uniform(), random.Uniform(), random.Uniform()) * 0.3 +
          Eigen::Vector3d::Constant(0.05);
      PhotoLight lens{gain, photos.falloffs.back()};
      lens.tone = photo % 2 == 0 ? more : less;
      pair.render = Display(light);
      pair.photo = Display(Toned(light, lens.tone).cwiseProduct(LightAt(lens, pair.place)));
      for (double& value : pair.photo) value += 0.01 * random.Normal();
      pairs.push_back(pair);
    }
    photos.pairs.push_back(pairs);
  }
  for (const int half : {-1, 0, 1}) {
    const std::vector<Eigen::Matrix3d> tones = FitTones(photos, 0, half);
    ASSERT_EQ(tones.size(), 8u);
    EXPECT_LT((tones[0] - more).cwiseAbs().maxCoeff(), 0.01) << tones[0];
    EXPECT_LT((tones[1] - less).cwiseAbs().maxCoeff(), 0.01) << tones[1];
    EXPECT_EQ(tones[0], tones[6]);
  }
  // A lens of three photos is not fitted: it has what makes the mean over all photos the identity.
  for (const int photo : {1, 3, 5}) photos.lenses[photo] = 2;
  photos.lenses[7] = 0;
  const std::vector<Eigen::Matrix3d> tones = FitTones(photos, 0, -1);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Eigen::Matrix3d& tone : tones) sum += tone;
  EXPECT_LT((sum / 8 - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  EXPECT_LT((tones[1] - tones[5]).norm(), 1e-12);
  EXPECT_GT((tones[0] - tones[1]).diagonal().minCoeff(), 0.02);
}

TEST(LightRefiner, FindsThatTwoCamerasDiffer) {
  Changed changed({.tone = 0.15, .seed = 6});
  LightRefiner refiner(&changed.scene, {}, EffectSwitch::kAuto);
  refiner.Refine(Compare(changed.scene, RenderOriginal));
  EXPECT_TRUE(refiner.IsOn()) << refiner.Report();
  EXPECT_TRUE(refiner.HasTones()) << refiner.Report();
  // The mean is the reference; the held-out photo has its lens'.
  const Eigen::Matrix3d& first = refiner.lights()[2].tone;
  const Eigen::Matrix3d& second = refiner.lights()[1].tone;
  EXPECT_LT((refiner.lights()[0].tone - first).norm(), 1e-12);
  EXPECT_LT(((24 * first + 32 * second) / 56 - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  EXPECT_GT((second - first).diagonal().minCoeff(), 0.1);
  // Both show the reference alike: photos of the second what those of the first would.
  double difference = 0, before = 0;
  int count = 0;
  for (int y = 0; y < 240; y += 5) {
    for (int x = 0; x < 320; x += 5) {
      const PhotoLight of_first = refiner.lights()[2];
      TrainingRay ray, original;
      changed.scene.Ray(1, x, y, &ray);
      Tabletop().Ray(1, x, y, &original);
      if (!ray.color.allFinite() || original.color.maxCoeff() > 0.9) continue;
      const Eigen::Vector3f shown = PhotographedColor(ray.color, of_first, {0, 0});
      const Eigen::Vector3d light = Eigen::Vector3d(LinearFromDisplay(original.color.x()),
                                                    LinearFromDisplay(original.color.y()),
                                                    LinearFromDisplay(original.color.z()));
      const Eigen::Vector3d by_second = Display(SecondCamera({.tone = 0.15}, light));
      difference += (shown - original.color).cwiseAbs().mean();
      before += (by_second.cast<float>() - original.color).cwiseAbs().mean();
      ++count;
    }
  }
  EXPECT_GT(count, 2000);
  EXPECT_GT(before, 0.025 * count);
  EXPECT_LT(difference, 0.3 * before);
}

TEST(LightRefiner, OneCameraHasNoTone) {
  Changed changed({.exposure = 0.2, .seed = 7});
  LightRefiner refiner(&changed.scene, {}, EffectSwitch::kAuto);
  refiner.Refine(Compare(changed.scene, RenderOriginal));
  EXPECT_TRUE(refiner.IsOn());
  EXPECT_FALSE(refiner.HasTones());
  EXPECT_EQ(refiner.lights()[1].tone, Eigen::Matrix3d::Identity());
}

TEST(LightRefiner, WaitsForAFoamThatShowsThePhotos) {
  Changed changed({.exposure = 0.3, .seed = 4});
  LightRefiner refiner(&changed.scene, {}, EffectSwitch::kAuto);
  refiner.Refine(Compare(changed.scene, [](const std::vector<ViewPixel>& pixels) {
    std::vector<RenderedRay> grey(pixels.size());
    for (RenderedRay& ray : grey) {
      ray.color = Eigen::Vector3f::Constant(0.5f);
      ray.opacity = 1;
    }
    return grey;
  }));
  EXPECT_FALSE(refiner.IsDecided());
  refiner.Refine(Compare(changed.scene, RenderOriginal));
  EXPECT_TRUE(refiner.IsOn());
}

TEST(LightRefiner, ObeysItsSwitch) {
  Changed changed({.exposure = 0.3, .seed = 4});
  LightRefiner off(&changed.scene, {}, EffectSwitch::kOff);
  EXPECT_FALSE(off.IsLooking());
  off.Refine(Compare(changed.scene, RenderOriginal));
  EXPECT_FALSE(off.IsOn());
  TrainingScene same(PlanScene(PhotosOf(TabletopPath())));
  LightRefiner on(&same, {}, EffectSwitch::kOn);
  on.Refine(Compare(same, RenderOriginal));
  EXPECT_TRUE(on.IsOn());
  EXPECT_LT(on.GainSpread(), 0.005);
}

TEST(LightRefiner, GivesTheSameOnAnyThreadsAndFromACheckpoint) {
  Changed changed({.exposure = 0.1, .shading = 0.2, .seed = 6});
  const auto gains_of = [](const LightRefiner& refiner) {
    std::vector<double> numbers;
    for (const PhotoLight& light : refiner.lights()) {
      numbers.insert(numbers.end(), light.gain.data(), light.gain.data() + 3);
      numbers.insert(numbers.end(), light.shading.data(), light.shading.data() + 15);
    }
    return numbers;
  };
  std::vector<double> first;
  for (const int threads : {1, 2, 5}) {
    const ThreadLimit limit(threads);
    LightRefiner refiner(&changed.scene, {}, EffectSwitch::kAuto);
    refiner.Refine(Compare(changed.scene, RenderOriginal));
    ASSERT_TRUE(refiner.IsOn());
    if (first.empty()) first = gains_of(refiner);
    EXPECT_EQ(gains_of(refiner), first) << threads;
  }

  LightRefiner refiner(&changed.scene, {}, EffectSwitch::kAuto);
  refiner.Refine(Compare(changed.scene, RenderOriginal));
  CheckpointContents contents;
  StateWriter writer("light", &contents);
  refiner.Serialize(&writer);
  const fs::path path = changed.folder / "light.checkpoint";
  WriteCheckpoint(path, contents);
  const Checkpoint checkpoint(path);
  changed.scene.SetLights({});
  LightRefiner resumed(&changed.scene, {}, EffectSwitch::kAuto);
  StateReader reader("light", checkpoint);
  resumed.Serialize(&reader);
  resumed.Restore();
  EXPECT_EQ(gains_of(resumed), first);
  EXPECT_LT(changed.Difference(), 0.02);
}

}  // namespace
}  // namespace semfoam
