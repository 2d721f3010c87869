// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/scene_options.h"
#include "plugin/dataset/training_scene.h"
#include "plugin/photo/photo_light.h"
#include "plugin/photometric/effects.h"
#include "plugin/photometric/view_comparison.h"

#include <cstdint>
#include <string>
#include <vector>

namespace semfoam {

// Fits the light of each training photo to renders of the foam in training, where a scene calls for
// it. The tracks that the probe (effects.h) looks at are few, and tell exposure only where the
// light of the scene stands still. A foam of 15 % of the run already knows the colours of all
// surfaces as all photos together show them; what a photo shows brighter or darker over wide areas
// is its light.
//
// For each photo and channel, log(photo / render) over a grid of pixels is fitted by a polynomial
// in the place in the photo: of degree 0 (a gain), 1 or 2 (PhotoLight). Weights make residuals
// those of display values, in which noise is about even, with Cauchy's weights against what is not
// light (edges, what the foam does not know yet). Least squares by iterated reweighting. Saturated,
// black and transparent pixels are left out.
//
// The first refinement decides, once for the scene: the photos are divided into blocks of pixels
// like a chessboard, fields are fitted to either colour and compared on the other. The light of
// photos is refined where this lowers the squared error of the display values on these held-back
// pixels by kLeastLightGain or more; a higher degree is chosen where it lowers it by another
// kLeastDegreeGain. It waits for the next refinement where the foam shows less than kLeastContrast
// of the photos' contrast: what such a foam lacks would pass for light. Held-out photos take no
// part.
//
// Where photos were taken by several cameras, each has its own way to render colours (contrast,
// saturation), which no gain explains: the tone of a lens (PhotoLight), fitted to all its photos
// beside their fields, is kept where that lowers the error on the held-back pixels by another
// kLeastToneGain. Lenses with fewer than kFewestOfLens photos are left as they are.
//
// Of the fields and tones, only differences between photos are known: their means over the training
// photos are taken out. Held-out photos get the light that is expected of them (ExpectedLights),
// unless the probe fitted theirs: only the training log looks at it.

// Shares of the squared error on held-back pixels. Unchanged photos (`tabletop`) reach 0.001.
inline constexpr double kLeastLightGain = 0.025;
inline constexpr double kLeastDegreeGain = 0.01;
inline constexpr double kLeastToneGain = 0.01;
inline constexpr int kFewestOfLens = 4;
inline constexpr double kLeastContrast = 0.7;

// Highest degree of a field.
inline constexpr int kMaxLightDegree = 2;

// A pixel of a photo and its render.
struct LightPair {
  // PlaceInPhoto.
  Eigen::Vector2d place;
  // Display values; the render's may exceed 1. It is in the reference exposure, or (WithLens) as a
  // lens shows that.
  Eigen::Vector3d photo;
  Eigen::Vector3d render;
  // Colour on the chessboard, 0 or 1.
  int half = 0;
};

// Logarithm of a photo's light over its render's: constant, then ShadingTerms.
using LightField = Eigen::Matrix<double, 3, 1 + kNumShadingTerms>;

// Fits a field of `degree` 0 to kMaxLightDegree to the pairs, or to those of one `half` (0, 1; -1:
// all). Zero without usable pairs: a weak prior draws all coefficients there.
LightField FitLightField(const std::vector<LightPair>& pairs, int degree, int half);

// Returns the pairs with the renders as this lens shows them: its tone and falloff.
std::vector<LightPair> WithLens(std::vector<LightPair> pairs, const PhotoLight& lens);

// Photos of several lenses: [photos] the pairs in the reference exposure, the number of the lens,
// and the falloff.
struct LensPairs {
  std::vector<std::vector<LightPair>> pairs;
  std::vector<int> lenses;
  std::vector<Eigen::Vector2d> falloffs;
};

// Fits the tone of each lens to the pairs of one `half` (0, 1; -1: all), beside a field of `degree`
// for each photo, in turn: the linear least squares of log(photo / field) on log(render), robust as
// FitLightField. Returns the tones [photos], whose mean is the identity; none is fitted that
// differs from it by more than 0.4 (Frobenius norm).
std::vector<Eigen::Matrix3d> FitTones(const LensPairs& photos, int degree, int half);

class LightRefiner {
 public:
  // `lights` are the scene's so far [views], or empty. `mode`: kOff never changes them, kOn chooses
  // a degree without a least gain. `scene` must outlive this object.
  LightRefiner(TrainingScene* scene, std::vector<PhotoLight> lights, EffectSwitch mode);

  // Returns whether Refine would look at renders: not where light is off, by the user or because
  // the scene does not call for it.
  bool IsLooking() const { return mode_ != EffectSwitch::kOff && !(decided_ && degree_ < 0); }

  // Fits the lights to renders and sets those of the scene (TrainingScene::SetLights), where it
  // IsLooking. The result does not depend on the number of threads.
  void Refine(const std::vector<ComparedView>& views);

  // Returns whether a Refine has found out if the scene calls for it.
  bool IsDecided() const { return decided_; }
  // Returns whether the lights are refined; false before the first Refine.
  bool IsOn() const { return degree_ >= 0; }
  // Returns the degree of the fields, -1 where lights are not refined.
  int degree() const { return degree_; }
  // Returns whether lenses have tones of their own.
  bool HasTones() const { return has_tones_; }
  // Returns the share of the squared error on held-back pixels that fields explained when it was
  // decided.
  double explained() const { return explained_; }
  // Returns the spread of the gains, and of the rest of the fields over the photos: roots of mean
  // squares of logarithms.
  double GainSpread() const;
  double ShadingSpread() const;
  // [views] The current lights; empty where none differs.
  const std::vector<PhotoLight>& lights() const { return lights_; }
  // Returns a line about the decision and the fields.
  std::string Report() const;
  // Returns the effect "shading" for effects.json.
  Effect MakeEffect() const;

  // Describes the decision and the lights for checkpoints. After reading, Restore must be called.
  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Number("light_decided", &decided_);
    archive->Number("light_degree", &degree_);
    archive->Number("light_explained", &explained_);
    archive->Number("light_has_tones", &has_tones_);
    if constexpr (Archive::kIsReader) {
      if (degree_ >= 0) lights_.resize(scene_->NumViews());
    }
    if (degree_ < 0) return;
    for (size_t view = 0; view < lights_.size(); ++view) {
      const std::string name = "light_" + std::to_string(view) + "_";
      PhotoLight& light = lights_[view];
      for (int i = 0; i < 3; ++i) archive->Number(name + std::to_string(i), &light.gain[i]);
      for (int i = 0; i < light.shading.size(); ++i) {
        archive->Number(name + std::to_string(3 + i), &light.shading.data()[i]);
      }
      for (int i = 0; i < light.tone.size() && has_tones_; ++i) {
        archive->Number(name + "tone_" + std::to_string(i), &light.tone.data()[i]);
      }
    }
  }
  // Sets the scene's lights to those that were read.
  void Restore();

 private:
  std::vector<LightPair> PairsOf(const ComparedView& compared) const;
  // Returns the training photos' pairs in the reference exposure.
  LensPairs CollectPairs(const std::vector<ComparedView>& views) const;
  // Chooses the degree and whether there are tones, on held-back pixels.
  void Decide(const LensPairs& photos);

  TrainingScene* const scene_;
  const EffectSwitch mode_;
  // Whether the lights before the first Refine tell those of held-out photos.
  const bool knows_held_out_;
  std::vector<int> training_views_;
  std::vector<PhotoLight> lights_;
  bool decided_ = false;
  int degree_ = -1;
  bool has_tones_ = false;
  double explained_ = 0;
};

}  // namespace semfoam
