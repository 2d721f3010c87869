// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/light_fit.h"

#include "foam/util/random_vectors.h"
#include "plugin/photometric/view_dependence.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

constexpr int kViews = 20;
constexpr int kPoints = 400;
constexpr int kViewsOfPoint = 5;

// What is put in.
struct Truth {
  double gains = 0;  // standard deviations
  double colors = 0;
  double falloff = 0;  // log light in the corners, all by r^4
  double planes = 0;
  double degree_1 = 0;  // of log light that varies as a spherical harmonic of degree 1
  double outliers = 0;  // share of samples that are far off
};

struct Scene {
  LightSamples samples;
  std::vector<Eigen::Vector3d> gains;  // logarithms
};

Scene MakeScene(const Truth& truth) {
  Scene scene;
  std::vector<Eigen::Matrix<double, 3, 2>> slopes;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int view = 0; view < kViews; ++view) {
    CounterRandom random(1, 1, view);
    const double gain = truth.gains * random.Normal();
    Eigen::Vector3d gains;
    for (int c = 0; c < 3; ++c) gains[c] = gain + truth.colors * random.Normal();
    scene.gains.push_back(gains);
    mean += gains / kViews;
    Eigen::Matrix<double, 3, 2> slope;
    for (int i = 0; i < 6; ++i) slope(i / 2, i % 2) = truth.planes * random.Normal();
    slopes.push_back(slope);
  }
  for (Eigen::Vector3d& gain : scene.gains) gain -= mean;
  scene.samples.num_points = kPoints;
  scene.samples.num_views = kViews;
  scene.samples.num_lenses = 1;
  for (int point = 0; point < kPoints; ++point) {
    CounterRandom random(1, 2, point);
    const Eigen::Vector3d color = NormalVector(&random) - Eigen::Vector3d::Ones();
    const Eigen::Vector3d tilt = truth.degree_1 * std::sqrt(3) * NormalVector(&random).normalized();
    const auto first = static_cast<int>(random.Below(kViews));
    for (int k = 0; k < kViewsOfPoint; ++k) {
      LightSample sample;
      sample.point = point;
      sample.view = (first + 3 * k) % kViews;
      sample.place = {random.Uniform(), random.Uniform()};
      sample.squared_radius = 2 * (sample.place - Eigen::Vector2d(0.5, 0.5)).squaredNorm();
      const double angle = 2 * std::numbers::pi * sample.view / kViews;
      sample.direction = Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.5).normalized();
      const double r4 = sample.squared_radius * sample.squared_radius;
      sample.log_light = color + scene.gains[sample.view];
      sample.log_light += slopes[sample.view] * (sample.place - Eigen::Vector2d(0.5, 0.5));
      sample.log_light.array() += truth.falloff * r4 + tilt.dot(sample.direction);
      for (int c = 0; c < 3; ++c) sample.log_light[c] += 0.03 * random.Normal();
      if (random.Uniform() < truth.outliers) sample.log_light.array() += 1.5 * random.Normal();
      scene.samples.all.push_back(sample);
    }
  }
  return scene;
}

// Root of the mean square of what the fit's gains miss.
double GainError(const LightFit& fit, const Scene& scene) {
  double sum = 0;
  for (int view = 0; view < kViews; ++view) {
    sum += (fit.gains[view] - scene.gains[view]).squaredNorm() / (3 * kViews);
  }
  return std::sqrt(sum);
}

TEST(LightFit, FindsWhatWasPutInInSpiteOfOutliers) {
  const Scene scene = MakeScene({.gains = 0.3, .colors = 0.05, .falloff = -0.4, .outliers = 0.05});
  const LightFit fit = FitLight(scene.samples, {2, true, false}, nullptr);
  EXPECT_LT(GainError(fit, scene), 0.015);
  EXPECT_NEAR(fit.CornerLight(), std::exp(-0.4), 0.02);
  EXPECT_NEAR(fit.GainSpread(), 0.3, 0.1);
  EXPECT_NEAR(fit.ColorSpread(), 0.05 * std::sqrt(2.0 / 3), 0.02);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& gain : fit.gains) mean += gain;
  EXPECT_LT(mean.norm(), 1e-3);
  // Each simpler model is worse by far.
  for (const LightModel& model :
       {LightModel{0, true, false}, {1, true, false}, {2, false, false}}) {
    EXPECT_GT(FitLight(scene.samples, model, nullptr).bic, fit.bic + 100);
  }
  // And planes are not needed.
  EXPECT_GT(FitLight(scene.samples, {2, true, true}, &fit).bic, fit.bic);
}

TEST(LightFit, FindsNothingWhereNothingIs) {
  for (const double outliers : {0.0, 0.1}) {
    const Scene scene = MakeScene({.outliers = outliers});
    const LightFit none = FitLight(scene.samples, {0, false, false}, nullptr);
    // Of 0.03, points take up a fifth of the variance; the noise's density has longer tails.
    if (outliers == 0) {
      EXPECT_NEAR(none.scale, 0.025, 0.003);
    }
    for (const LightModel& model : {LightModel{1, false, false},
                                    {2, false, false},
                                    {0, true, false},
                                    {2, true, false},
                                    {0, false, true}}) {
      EXPECT_GT(FitLight(scene.samples, model, &none).bic, none.bic);
    }
  }
}

TEST(LightFit, GreyGainsHaveNoColour) {
  const Scene scene = MakeScene({.gains = 0.3});
  const LightFit grey = FitLight(scene.samples, {1, false, false}, nullptr);
  EXPECT_LT(GainError(grey, scene), 0.01);
  EXPECT_LT(grey.ColorSpread(), 1e-12);
  EXPECT_LT(grey.bic, FitLight(scene.samples, {2, false, false}, &grey).bic);
}

TEST(LightFit, PlanesTellAMovingLamp) {
  const Scene scene = MakeScene({.gains = 0.1, .planes = 0.3});
  const LightFit gains = FitLight(scene.samples, {2, false, false}, nullptr);
  const LightFit planes = FitLight(scene.samples, {2, false, true}, &gains);
  EXPECT_LT(planes.bic, gains.bic - 100);
  // A slope of 0.3 over a place that is uniform in 0..1, twice.
  EXPECT_NEAR(planes.PlaneSpread(scene.samples.all), 0.3 * std::sqrt(2.0 / 12), 0.03);
}

TEST(LightFit, BeginsAnywhereAndEndsAtTheSamePlace) {
  const Scene scene = MakeScene({.gains = 0.3, .falloff = -0.2, .outliers = 0.1});
  const LightFit none = FitLight(scene.samples, {0, false, false}, nullptr);
  const LightFit direct = FitLight(scene.samples, {2, true, false}, nullptr);
  const LightFit stepwise = FitLight(scene.samples, {2, true, false}, &none);
  EXPECT_NEAR(direct.bic, stepwise.bic, 1);
  EXPECT_NEAR(direct.CornerLight(), stepwise.CornerLight(), 1e-3);
}

TEST(LightFit, ViewsThatTookNoPartGetTheirOwnGain) {
  Scene scene = MakeScene({.gains = 0.3});
  LightSamples training = scene.samples;
  std::vector<LightSample> held_out;
  std::erase_if(training.all, [](const LightSample& sample) { return sample.view >= kViews - 2; });
  for (const LightSample& sample : scene.samples.all) {
    if (sample.view == kViews - 1) held_out.push_back(sample);
  }
  const LightFit fit = FitLight(training, {2, false, false}, nullptr);
  const std::vector<int> lenses(kViews, 0);
  const std::vector<PhotoLight> lights = fit.Lights(lenses, held_out);
  ASSERT_EQ(lights.size(), size_t{kViews});
  const Eigen::Vector3d relative = (lights[kViews - 1].gain.array() / lights[0].gain.array()).log();
  EXPECT_LT((relative - (scene.gains[kViews - 1] - scene.gains[0])).norm(), 0.03);
  // Nothing shows this one.
  EXPECT_EQ(lights[kViews - 2].gain, Eigen::Vector3d::Ones());
}

TEST(LightFitViewDependence, FindsTheDegreeThatIsThere) {
  for (const double truth : {0.0, 0.1}) {
    const Scene scene = MakeScene({.degree_1 = truth});
    const LightFit fit = FitLight(scene.samples, {0, false, false}, nullptr);
    const std::vector<ViewDependence> degrees = FitViewDependence(scene.samples.all, fit);
    ASSERT_EQ(degrees.size(), 3u);
    if (truth == 0) {
      EXPECT_LT(degrees[0].bic_gain, 0);
    } else {
      EXPECT_GT(degrees[0].bic_gain, 100);
      // Of the variance over the sphere, these views on a circle show the part within it.
      EXPECT_NEAR(degrees[0].spread, 0.1 * std::sqrt(0.8), 0.03);
    }
    EXPECT_LT(degrees[1].bic_gain, 0);
    EXPECT_LT(degrees[2].bic_gain, 0);
  }
}

TEST(LightFitViewDependence, ShortTracksTellNothing) {
  Scene scene = MakeScene({});
  std::vector<LightSample> pairs;
  for (size_t i = 0; i < scene.samples.all.size(); ++i) {
    if (i % kViewsOfPoint < 2) pairs.push_back(scene.samples.all[i]);
  }
  scene.samples.all = pairs;
  const LightFit fit = FitLight(scene.samples, {0, false, false}, nullptr);
  EXPECT_TRUE(FitViewDependence(pairs, fit).empty());
}

// More than 400 photos, of which most show nothing here, are fitted in another way.
TEST(LightFit, IsTheSameByConjugateGradients) {
  const Scene scene =
      MakeScene({.gains = 0.3, .colors = 0.05, .falloff = -0.4, .planes = 0.1, .outliers = 0.05});
  LightSamples many = scene.samples;
  many.num_views = 500;
  for (const bool planes : {false, true}) {
    for (const int gains : {0, 1, 2}) {
      const LightModel model = {gains, true, planes};
      const LightFit exact = FitLight(scene.samples, model, nullptr);
      const LightFit fit = FitLight(many, model, nullptr);
      EXPECT_NEAR(fit.bic, exact.bic, 0.1) << gains << planes;
      EXPECT_NEAR(fit.scale, exact.scale, 1e-4 * exact.scale) << gains << planes;
      EXPECT_NEAR(fit.CornerLight(), exact.CornerLight(), 1e-3) << gains << planes;
      for (int view = 0; view < kViews; ++view) {
        EXPECT_LT((fit.gains[view] - exact.gains[view]).norm(), 1e-3) << gains << planes << view;
      }
    }
  }
}

}  // namespace
}  // namespace semfoam
