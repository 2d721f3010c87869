// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"
#include "foam/util/ids.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Computes the peak signal-to-noise ratio in dB over all pixels and channels, peak 255; infinity
// for equal images. CHECKs equal sizes.
double Psnr(const Image8& render, const Image8& photo);

// Computes the structural similarity (Wang et al. 2004), the mean over pixels and channels:
// 11-pixel Gaussian window, sigma 1.5, image borders mirrored with the border pixel repeated, K1 =
// 0.01, K2 = 0.03. CHECKs equal sizes.
double Ssim(const Image8& render, const Image8& photo);

// Measures how well rendered classes agree with the classes of masks, over any number of pixels.
class LabelAgreement {
 public:
  // Adds one pixel: its class in the masks and its rendered class, both 0 or more. A pixel with a
  // `truth` of kUnlabelled is left out; a `shown` of kUnlabelled agrees with no class.
  void Add(ClassIndex truth, ClassIndex shown);

  // Returns the mean intersection over union, 0..1, over the classes that occur in the truth; NaN
  // without any.
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
