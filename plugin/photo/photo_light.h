// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>

#include <Eigen/Core>

namespace semfoam {

// Terms of a polynomial of degree 2 over a photo, without the constant.
inline constexpr int kNumShadingTerms = 5;

// The difference of a photo's light from the reference exposure, in linear light:
//
//   photo = gain * exp(falloff[0] r^2 + falloff[1] r^4 + shading * ShadingTerms(u, v))
//           * Toned(reference, tone)
//
// per channel, (u, v) being the offset from the middle of the photo over half its diagonal and r
// its length. The gain is exposure and white balance, the falloff is vignetting, the shading is
// light that differs from one side of a photo to the other, the tone is the contrast and the
// saturation of a camera; as a logarithm all are linear.
struct PhotoLight {
  Eigen::Vector3d gain = Eigen::Vector3d::Ones();
  Eigen::Vector2d falloff = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 3, kNumShadingTerms> shading =
      Eigen::Matrix<double, 3, kNumShadingTerms>::Zero();
  Eigen::Matrix3d tone = Eigen::Matrix3d::Identity();
};

// Linear light at which a tone changes nothing, a grey card's.
inline constexpr double kMidGrey = 0.18;

// Returns exp(tone * log(light / kMidGrey)) * kMidGrey. Light below 1e-4 counts as that, unless the
// tone is the identity, which changes nothing. The tone's inverse undoes it.
Eigen::Vector3d Toned(const Eigen::Vector3d& light, const Eigen::Matrix3d& tone);

// Returns (u, v) of PhotoLight at a position in a photo, in pixels (the corner of the photo is (0,
// 0)).
Eigen::Vector2d PlaceInPhoto(const Eigen::Vector2d& pixel, int width, int height);

// Returns u, v, u^2, u v, v^2.
Eigen::Matrix<double, kNumShadingTerms, 1> ShadingTerms(const Eigen::Vector2d& place);

// Returns the factor of PhotoLight at PlaceInPhoto, without the tone.
Eigen::Vector3d LightAt(const PhotoLight& light, const Eigen::Vector2d& place);

// Returns the display values (sRGB / 255, 0..1) of a pixel in the reference exposure: divides its
// light by LightAt, takes back the tone and clips at white, as in a photo. Returns NaN where the
// colour is not known: a channel is saturated (254 or more), and the photo is so much brighter than
// the reference that white would turn grey by more than 5 of 255.
Eigen::Vector3f ReferenceColor(const uint8_t* rgb,
                               const PhotoLight& light,
                               const Eigen::Vector2d& place);

// Returns the same, but the least that saturated channels may be, and sets their bits in
// `at_least`: bit c for channel c. NaN only with a tone, which mixes the channels.
Eigen::Vector3f LeastReferenceColor(const uint8_t* rgb,
                                    const PhotoLight& light,
                                    const Eigen::Vector2d& place,
                                    uint8_t* at_least);

// Returns the display values that a photo in this light shows of a colour (display values, 0 or
// more) in the reference exposure: multiplies its light, Toned, by LightAt, and clips at white.
// White stays white in darker photos, too, as ReferenceColor has it; what is nearly white (0.94 or
// more in all channels) goes over to that.
Eigen::Vector3f PhotographedColor(const Eigen::Vector3f& reference,
                                  const PhotoLight& light,
                                  const Eigen::Vector2d& place);

}  // namespace semfoam
