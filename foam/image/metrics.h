// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"
#include "foam/util/ids.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Peak signal-to-noise ratio in dB over all pixels and channels, peak 255; infinity for equal
// images. CHECKs equal sizes.
double Psnr(const Image8& render, const Image8& photo);

// Structural similarity (Wang et al. 2004), mean over pixels and channels: 11-pixel Gaussian
// window, sigma 1.5, image borders mirrored with the border pixel repeated, K1 = 0.01, K2 = 0.03.
// CHECKs equal sizes.
double Ssim(const Image8& render, const Image8& photo);

// How well classes that were rendered agree with those that masks give, over any number of pixels.
class LabelAgreement {
 public:
  // One pixel: its class by the masks and as shown. A `truth` of kUnlabelled says nothing, and the
  // pixel is left out; a `shown` of kUnlabelled agrees with no class.
  void Add(ClassIndex truth, ClassIndex shown);

  // The mean of intersection over union, 0..1, over the classes that occur in the truth; NaN where
  // none does.
  double MeanIou() const;

 private:
  struct Pixels {
    int64_t truth = 0;
    int64_t shown = 0;
    int64_t both = 0;
  };
  Pixels& Of(ClassIndex class_index);

  std::vector<Pixels> of_class_;
};

}  // namespace semfoam
