// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photo/photo_light.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// A point in a photo. Points, views and lenses are numbers from 0 on.
struct LightSample {
  int point = 0;
  int view = 0;
  int lens = 0;
  Eigen::Vector3d log_light;  // natural logarithm of the linear light
  double squared_radius = 0;  // as PhotoLight has it
  Eigen::Vector2d place;      // in the photo, any origin and unit
  Eigen::Vector3d direction;  // from the camera to the point, unit length, world axes
};

// Samples ordered by point, at least one for each.
struct LightSamples {
  std::vector<LightSample> all;
  int num_points = 0;
  int num_views = 0;   // those without a sample too
  int num_lenses = 0;  // likewise
};

// Which terms the model of the photos' light has (effects.h holds the formula).
struct LightModel {
  int gains = 0;         // 0: none; 1: one for each photo; 2: one for each channel of each photo
  bool falloff = false;  // vignetting, one for each lens
  bool planes = false;   // a plane over each photo and channel
};

// The fitted model. Gains and planes are logarithms.
struct LightFit {
  LightModel model;
  std::vector<Eigen::Vector3d> points;              // log light at the reference exposure
  std::vector<Eigen::Vector3d> gains;               // [views], their mean over the views seen is 0
  std::vector<Eigen::Vector2d> falloff;             // [lenses]
  std::vector<Eigen::Matrix<double, 3, 2>> planes;  // [views], slopes over place - centers[view]
  std::vector<Eigen::Vector2d> centers;             // [views], of the samples
  std::vector<char> is_seen;                        // [views], whether it has a sample
  double scale = 0;                                 // of the noise (Huber's)
  double bic = 0;

  // y - model, for a sample of any view.
  Eigen::Vector3d Residual(const LightSample& sample) const;
  // How much a residual counts: 1 within twice the scale, less and less beyond.
  double Weight(const Eigen::Vector3d& residual) const;

  // Roots of mean squares over the views seen: of the gains; of their channels around their mean.
  double GainSpread() const;
  double ColorSpread() const;
  // Light in the corners over light in the middle, mean over the lenses.
  double CornerLight() const;
  // Standard deviation of the falloff, root of mean square of the planes, over the samples.
  double FalloffSpread(const std::vector<LightSample>& samples) const;
  double PlaneSpread(const std::vector<LightSample>& samples) const;

  // The light of every view. The gains of views that took no part are fitted to their samples in
  // `others`, the rest of the model held; 1 where there are none. `lenses` is [views].
  std::vector<PhotoLight> Lights(const std::vector<int>& lenses,
                                 const std::vector<LightSample>& others) const;
};

// Fits by maximum likelihood; noise is Huber's, normal within twice its scale and of
// exponential tails, jointly over the channels. Begins at `simpler`, a fit of a nested model to the
// same samples, if there is one. The same bytes on any number of threads.
LightFit FitLight(const LightSamples& samples, const LightModel& model, const LightFit* simpler);

}  // namespace semfoam
