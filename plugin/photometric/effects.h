// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/scene_options.h"
#include "plugin/dataset/training_scene.h"
#include "plugin/photo/photo_light.h"
#include "plugin/photometric/view_dependence.h"

#include <map>
#include <string>
#include <vector>

namespace semfoam {

// Decides before training which effects a scene calls for (the probe), from what COLMAP's tracks
// show of the same points in many photos. Simulates nothing itself.
//
// The logarithm of the light (mean of 3x3 pixels, linear) that photo i shows of point j is
//
//   y_ij = point_j + gain_i + falloff(r_ij) + noise,
//
// with the terms of PhotoLight and Huber's noise (normal, with exponential tails), whose scale is
// estimated too: outliers (moved, mirrored, occluded) count little. Nested models are fitted to the
// same observations by maximum likelihood (Ceres), and compared by
// BIC = deviance + parameters * ln(observations); observations that points take up are not counted.
// The more complex model must have the lower BIC *and* an effect that can be seen.
//
// - Exposure: one gain a photo. Seen: the gains' spread (root of mean square) is 1 % or more.
// - White balance: three gains a photo, against one. Seen: their colours spread by 1 % or more.
// - Vignetting: a falloff for each lens. Seen: corners darkened by 3 % or more; 2 % or more of the
//   observations farther out than half-way to the corners (r^2 = 0.5), for a thing in the middle of
//   its photos tells nothing of corners; and all quarters of the photos alike: fitted to each
//   quarter, of all lenses together, the falloff half-way to the corners is at least half of its
//   mean over the quarters. A lamp, a floor or gloss that photos have on one side darkens the
//   other.
// - None of the three where the light moves: an object on a turntable turns away from its lamp, and
//   whole photos of it darken. But then parts of a photo darken more than others. So a plane over
//   each photo is fitted too; where the planes lower the BIC and vary by more than half of what the
//   effect does, the effect is due to light and shadow, not to the camera.
// - View dependence: the light of a point varies over directions with the covariance
//   sum_l rho_l^2 P_l(cos angle), P_l being Legendre's polynomials: that of random spherical
//   harmonics. Degree l is seen where it makes 1 % or more over the photos that show a point, and
//   is taken only when all lower degrees are. (Restricted maximum likelihood, one rho a degree.)
//   Matching keeps what looks alike from everywhere, so tracks show the matte part of a scene.
//   Therefore, where they show a degree, one more is simulated; where they show none, none.
// - Blur: photos with less contrast than others of the same places (photo_blur.h) are drawn less.
// - Distortion: seen where it moves a corner of the image by kLeastDistortion or more.
// - Semantics: on where there are masks.
// - Background: white, which costs nothing; no other is simulated. The share of the photos' borders
//   that is white is reported.
//
// Held-out photos are left out of all decisions and of the points' colours. Their own light is
// fitted afterwards, so that the log can compare them with the foam.

struct EffectsOptions {
  EffectSwitch exposure = EffectSwitch::kAuto;
  // kOn implies exposure.
  EffectSwitch white_balance = EffectSwitch::kAuto;
  EffectSwitch vignetting = EffectSwitch::kAuto;
  // Not decided by the probe, but during the training (light_refinement.h).
  EffectSwitch shading = EffectSwitch::kAuto;
  // Not decided by the probe, but before and during the training (pose_refinement.h).
  EffectSwitch poses = EffectSwitch::kAuto;
  // Whether to look for what passes by, during the training (transient_things.h).
  bool transients = true;
  // Whether to look for what is infinitely far, in the plane sweep (stereo/far_regions.h).
  bool sky = true;
  // Whether to draw blurred photos less.
  bool blur = true;
  // Copied from the SceneOptions of the scene: distortion and use_masks.
  EffectSwitch distortion = EffectSwitch::kAuto;
  bool semantics = true;
  // Maximum degree of the spherical harmonics that the probe may choose.
  int sh_degree = 3;
  // Whether to use exactly this degree, whatever the probe finds.
  bool fixed_sh_degree = false;
};

// One line of the table of effects.
struct Effect {
  // Name of the option: "exposure", "sh_degree" ...
  std::string name;
  // Whether it is simulated.
  bool on = false;
  // Whether the user decided it.
  bool by_option = false;
  // The reason in words, with the figures.
  std::string evidence;
  // The figures, for scripts.
  std::map<std::string, double> measures;
  // What simulating it costs, in words.
  std::string cost;
};

struct SceneEffects {
  std::vector<Effect> effects;
  int sh_degree = 0;
  // [views] Difference of each view's light from the reference exposure, in which the training
  // photos' gains have the geometric mean 1. Empty where neither exposure nor vignetting is on.
  std::vector<PhotoLight> lights;
  // [views] How often each view's pixels are drawn (TrainingViews::PassesPerDraw). Empty where no
  // photo is blurred.
  std::vector<int> passes_per_draw;
  // [views] Number of each view's lens (ScenePlan::lenses).
  std::vector<int> lenses;
  // The figures that sh_degree follows from.
  std::vector<ViewDependence> view_dependence;

  // Returns the effect of this name. CHECKs that it exists.
  const Effect& Find(const std::string& name) const;
};

// Probes the photos as they are (before SetLights). Takes seconds at most for hundreds of photos;
// the result is the same on any number of threads. Scenes without tracks get only the effects that
// need none, and the SH degree of the options.
SceneEffects ProbeEffects(const TrainingScene& scene, const EffectsOptions& options);

// Chooses the SH degree again from the figures of the probe, where `sh_degree` of the options has
// changed.
void ChooseShDegree(const EffectsOptions& options, SceneEffects* effects);

}  // namespace semfoam
