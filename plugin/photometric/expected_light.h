// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/photo/photo_light.h"

#include <vector>

#include <Eigen/Core>

namespace semfoam {

// Predicts the light of a view without looking at a photo of it, from the photos that a foam was
// trained on. A camera on automatic exposes photos of one place alike, a lens darkens the corners
// of all its photos, and a lamp beside the camera moves with it: so a render that is to be held
// against a photo is best shown in the light of the photos that were taken nearest.
//
//   log light(view) = lens(view) + trust * sum_k w_k (log light(photo k) - lens(photo k))
//
// `lens` is the mean over the photos of a lens, if these are four or more, else over the photos of
// all such lenses. The sum goes over the three nearest photos, with weights in proportion to
// 1 / (distance^2 + 1e-4); the distance is that of the centres over the cameras' extent (root of
// the mean squared distance from their mean), plus the angle of the rotation between the cameras,
// in radians. `trust`, 0 to 1, is the factor with which the others predict a photo best (least
// squares over a grid of places in the photos): near 0 where each photo has a light of its own.

class ExpectedLights {
 public:
  // `lenses` [photos]: numbers of their lenses. `lights` [photos]: of those that were not held out;
  // what it says of others is not looked at. CHECKs the sizes.
  ExpectedLights(const std::vector<PhotoRecord>& photos,
                 const std::vector<int>& lenses,
                 std::vector<PhotoLight> lights);

  // Returns the light of a photo: its own, or, where it was held out, the one that is expected.
  PhotoLight OfPhoto(size_t photo) const;

  // Returns the light that is expected of a view with this pose (in the user's frame) and of an
  // unknown lens.
  PhotoLight At(const Pose& cam_from_world) const;

  double trust() const { return trust_; }

 private:
  // Logarithm of a light: gain, shading (by rows), falloff, what the tone has beyond the identity
  // (by columns).
  using Terms = Eigen::Matrix<double, 3 + 3 * kNumShadingTerms + 2 + 9, 1>;

  struct Place {
    Eigen::Matrix3d rotation;
    Eigen::Vector3d center;
  };

  static Terms TermsOf(const PhotoLight& light);
  static PhotoLight LightOf(const Terms& terms);

  static Place PlaceOf(const Pose& cam_from_world);
  void FindLenses(const std::vector<int>& lenses);
  void FindTrust();
  double Distance(const Place& a, const Place& b) const;
  // Returns the weighted mean of the residuals of the photos nearest to `place`, but for the one at
  // `but` among those that were trained on.
  Terms Nearest(const Place& place, size_t but) const;

  // [photos]
  std::vector<PhotoLight> lights_;
  std::vector<Place> places_;
  std::vector<char> is_held_out_;
  // [photos] The mean over the photo's lens.
  std::vector<Terms> of_lens_;
  // Of an unknown lens.
  Terms of_any_lens_ = Terms::Zero();
  // Places of the photos that were trained on, and what their light has beyond their lens'.
  std::vector<Place> trained_places_;
  std::vector<Terms> residuals_;
  double extent_ = 1;
  double trust_ = 0;
};

}  // namespace semfoam
