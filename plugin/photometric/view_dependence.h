// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photometric/light_fit.h"

#include <vector>

namespace semfoam {

// Measures how much the light of points varies with the direction from which they are seen.

// The contribution of one degree of spherical harmonics beyond the degrees below it.
struct ViewDependence {
  int degree = 0;
  // Standard deviation of the log light that the degree makes, over the directions from which the
  // photos show a point.
  double spread = 0;
  // BIC without the degree less BIC with it.
  double bic_gain = 0;
};

// Fits degrees 1, 2 and 3. The residuals of `fit` at one point are taken as normal, with covariance
//
//   s^2 / weight_i [i = k] + sum_l rho_l^2 P_l(direction_i . direction_k),
//
// that of random spherical harmonics of degree l whose light has the standard deviation rho_l (the
// addition theorem); the point's mean is free. s and rho are those of the greatest restricted
// likelihood, one rho more for each degree. Returns nothing where fewer than 100 samples are of
// points that three photos or more show.
std::vector<ViewDependence> FitViewDependence(const std::vector<LightSample>& samples,
                                              const LightFit& fit);

}  // namespace semfoam
