// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

namespace semfoam {

// The difference of a photo's light from the reference exposure, in linear light:
//
//   photo = gain * exp(falloff[0] r^2 + falloff[1] r^4) * reference
//
// per channel, r being the distance from the middle of the photo over half its diagonal. The gain
// is exposure and white balance, the exponential is vignetting; as a logarithm both are linear.
struct PhotoLight {
  Eigen::Vector3d gain = Eigen::Vector3d::Ones();
  Eigen::Vector2d falloff = Eigen::Vector2d::Zero();
};

// Returns r^2 of PhotoLight at a position in a photo, in pixels (the corner of the photo is (0,
// 0)).
double SquaredRadius(const Eigen::Vector2d& pixel, int width, int height);

// Returns the factor of PhotoLight at r^2.
Eigen::Vector3d LightAt(const PhotoLight& light, double squared_radius);

// Returns the display values (sRGB / 255, 0..1) of a pixel in the reference exposure: divides its
// light by LightAt and clips at white, as in a photo. Returns NaN where the colour is not known: a
// channel is saturated (254 or more), and the photo is so much brighter than the reference that
// white would turn grey by more than 5 of 255.
Eigen::Vector3f ReferenceColor(const uint8_t* rgb, const PhotoLight& light, double squared_radius);

}  // namespace semfoam
