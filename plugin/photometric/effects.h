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

// The probe: which effects a scene calls for, decided before training from what COLMAP's tracks
// show of the same points in many photos. It simulates nothing itself.
//
// The logarithm of the light (mean of 3x3 pixels, linear) that photo i shows of point j is
//
//   y_ij = point_j + gain_i + falloff(r_ij) + noise,
//
// with the terms of PhotoLight and Huber's noise (normal, with exponential tails), whose scale is
// estimated along: outliers (moved, mirrored, occluded) count little. Nested models
// are fitted to the same observations by maximum likelihood (Ceres), and compared by
// BIC = deviance + parameters * ln(observations); observations that points take up are not counted.
// The more complex model must have the lower BIC *and* an effect that can be seen.
//
// - Exposure: one gain a photo. Seen: the gains' spread (root of mean square) is 1 % or more.
// - White balance: three gains a photo, against one. Seen: their colours spread by 1 % or more.
// - Vignetting: a falloff for each lens. Seen: corners darkened by 3 % or more.
// - None of the three where it is the light that moves: an object on a turntable turns away from
//   its lamp, and whole photos of it darken. But then parts of a photo darken more than others.
//   So a plane over each photo is fitted along; where the planes pay (by BIC) and vary by more than
//   half of what the effect does, the effect is light and shadow and no business of the camera's.
// - View dependence: the light of a point varies over directions with the covariance
//   sum_l rho_l^2 P_l(cos angle), P_l being Legendre's polynomials: that of random spherical
//   harmonics. Degree l is seen where it makes 1 % or more over the photos that show a point, and
//   is taken only when all lower degrees are. (Restricted maximum likelihood, one rho a degree.)
//   Matching keeps what looks alike from everywhere, so tracks show the matte part of a scene. So
//   where they show a degree, one more is simulated; where they show none, none.
// - Distortion: seen where it moves a corner of the image by kLeastDistortion or more.
// - Semantics: masks are there.
// - Background: white, which costs nothing; no other is simulated. How much of the photos' borders
//   is white is told.
//
// Held-out photos take no part in any decision, nor in the points' colours. Their own light is
// fitted afterwards, so that the log can compare them with the foam.

struct EffectsOptions {
  EffectSwitch exposure = EffectSwitch::kAuto;
  EffectSwitch white_balance = EffectSwitch::kAuto;  // kOn implies exposure
  EffectSwitch vignetting = EffectSwitch::kAuto;
  EffectSwitch distortion = EffectSwitch::kAuto;  // as the scene was planned with
  bool semantics = true;                          // likewise
  int sh_degree = 3;                              // the probe chooses up to this one
  bool fixed_sh_degree = false;                   // true: this very degree, whatever the probe says
};

// One line of the table.
struct Effect {
  std::string name;  // as the options spell it: "exposure", "sh_degree" ...
  bool on = false;
  bool by_option = false;                  // decided by the user
  std::string evidence;                    // in words, with the figures
  std::map<std::string, double> measures;  // the figures, for scripts
  std::string cost;                        // of having it on
};

struct SceneEffects {
  std::vector<Effect> effects;
  int sh_degree = 0;
  // How each view's light differs from the reference exposure, in which the training photos' gains
  // have the geometric mean 1. Empty where neither exposure nor vignetting is on.
  std::vector<PhotoLight> lights;
  std::vector<ViewDependence> view_dependence;  // behind sh_degree

  const Effect& Find(const std::string& name) const;  // CHECKs that there is one
};

// Looks at the photos as they are (before SetLights). Takes seconds at most for hundreds of photos;
// the same on any number of threads. Scenes without tracks get what needs none, and the SH degree
// of the options.
SceneEffects ProbeEffects(const TrainingScene& scene, const EffectsOptions& options);

// Chooses the SH degree again, of what was probed, where `sh_degree` of the options has changed.
void ChooseShDegree(const EffectsOptions& options, SceneEffects* effects);

}  // namespace semfoam
