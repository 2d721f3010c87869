// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photo/photo_light.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Fits a model of the photos' light to samples of it at the points of tracks.

// A point in a photo. Points, views and lenses are numbers from 0 on.
struct LightSample {
  int point = 0;
  int view = 0;
  int lens = 0;
  // Natural logarithm of the linear light, RGB.
  Eigen::Vector3d log_light;
  // r^2 of PhotoLight.
  double squared_radius = 0;
  // Quarter of the photo: 0, right of its middle 1 more, below it 2 more.
  int quarter = 0;
  // Position in the photo, of any origin and unit.
  Eigen::Vector2d place;
  // From the camera to the point, unit length, world axes.
  Eigen::Vector3d direction;
};

// Samples ordered by point, at least one for each.
struct LightSamples {
  std::vector<LightSample> all;
  int num_points = 0;
  // Number of views and of lenses, those without a sample too.
  int num_views = 0;
  int num_lenses = 0;
};

// Terms of the model of the photos' light (effects.h holds the formula).
struct LightModel {
  // 0: no gains; 1: one for each photo; 2: one for each channel of each photo.
  int gains = 0;
  // Whether there is vignetting, one for each lens.
  bool falloff = false;
  // Whether there is a plane over each photo and channel.
  bool planes = false;
};

// The fitted model. Gains and planes are logarithms.
struct LightFit {
  LightModel model;
  // [points] Logarithm of the light at the reference exposure.
  std::vector<Eigen::Vector3d> points;
  // [views] Mean 0 over the views with samples.
  std::vector<Eigen::Vector3d> gains;
  // [lenses]
  std::vector<Eigen::Vector2d> falloff;
  // [views] Slopes over place - centers[view].
  std::vector<Eigen::Matrix<double, 3, 2>> planes;
  // [views] Mean place of the samples.
  std::vector<Eigen::Vector2d> centers;
  // [views] Whether it has a sample.
  std::vector<char> is_seen;
  // Scale of the noise (Huber's).
  double scale = 0;
  double bic = 0;

  // Returns y - model, for a sample of any view.
  Eigen::Vector3d Residual(const LightSample& sample) const;
  // Returns the weight of a residual: 1 within twice the scale, less and less beyond.
  double Weight(const Eigen::Vector3d& residual) const;

  // Return roots of mean squares over the views seen: of the gains; of their channels around their
  // mean.
  double GainSpread() const;
  double ColorSpread() const;
  // Returns the light in the corners over light in the middle, mean over the lenses.
  double CornerLight() const;
  // Return the standard deviation of the falloff, and the root of the mean square of the planes,
  // over the samples.
  double FalloffSpread(const std::vector<LightSample>& samples) const;
  double PlaneSpread(const std::vector<LightSample>& samples) const;

  // Returns the light of every view. The gains of views that were not fitted are fitted to their
  // samples in `others`, with the rest of the model fixed; 1 where there are none. `lenses` is
  // [views].
  std::vector<PhotoLight> Lights(const std::vector<int>& lenses,
                                 const std::vector<LightSample>& others) const;
};

// Fits by maximum likelihood; noise is Huber's, normal within twice its scale and with exponential
// tails, jointly over the channels. Starts from `simpler`, a fit of a nested model to the same
// samples, unless it is null. Gives the same bytes on any number of threads.
LightFit FitLight(const LightSamples& samples, const LightModel& model, const LightFit* simpler);

}  // namespace semfoam
