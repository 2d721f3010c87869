// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

namespace semfoam {

// How the light that a photo shows differs from the reference exposure, in linear light:
//
//   photo = gain * exp(falloff[0] r^2 + falloff[1] r^4) * reference
//
// per channel, r being the distance from the middle of the photo over half its diagonal. The gain
// is exposure and white balance, the exponential is vignetting; as a logarithm both are linear.
struct PhotoLight {
  Eigen::Vector3d gain = Eigen::Vector3d::Ones();
  Eigen::Vector2d falloff = Eigen::Vector2d::Zero();
};

// r^2 of PhotoLight at a place in a photo, in pixels (the corner of the photo is (0, 0)).
double SquaredRadius(const Eigen::Vector2d& pixel, int width, int height);

// The factor of PhotoLight at r^2.
Eigen::Vector3d LightAt(const PhotoLight& light, double squared_radius);

// The display values (sRGB / 255, 0..1) that the pixel would have had in the reference exposure:
// light is divided by LightAt and what is beyond white becomes white, as in a photo. Not a number
// where that cannot be known: a channel is saturated (254 or more) and the photo is so much
// brighter than the reference that it would turn grey, by more than 5 of 255.
Eigen::Vector3f ReferenceColor(const uint8_t* rgb, const PhotoLight& light, double squared_radius);

}  // namespace semfoam
