// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/host_device.h"

#include <cmath>

namespace semfoam {

// Computes the density of a cell from its raw parameter: sigma = kDensityScale * softplus_10(raw),
// softplus_10(x) = ln(1 + exp(10 x)) / 10 (Radiant Foam's activation). The scale makes a raw
// density of 1 opaque across a typical cell of the normalised frame (radius about 0.01), so that a
// handful of optimiser steps moves a cell between air and matter; Radiant Foam has 1 here, for
// scenes ten times as large and twenty times as many steps.
inline constexpr double kDensityScale = 50;
inline constexpr double kSoftplusBeta = 10;
// Above this argument exp() adds less than the last bit of a float.
inline constexpr double kSoftplusLinear = 20;

template <typename T>
SEMFOAM_HOST_DEVICE T Density(const T& raw) {
  using std::exp;
  using std::log1p;
  const T x = T(kSoftplusBeta) * raw;
  if (x > T(kSoftplusLinear)) return T(kDensityScale) * raw;
  return T(kDensityScale / kSoftplusBeta) * log1p(exp(x));
}

// Computes d Density / d raw.
template <typename T>
SEMFOAM_HOST_DEVICE T DensityDerivative(const T& raw) {
  using std::exp;
  const T x = T(kSoftplusBeta) * raw;
  if (x > T(kSoftplusLinear)) return T(kDensityScale);
  return T(kDensityScale) / (T(1) + exp(-x));
}

// Returns the raw density whose density is `sigma` > 0.
inline double RawDensity(double sigma) {
  const double y = kSoftplusBeta * sigma / kDensityScale;
  return (y > kSoftplusLinear ? y : std::log(std::expm1(y))) / kSoftplusBeta;
}

}  // namespace semfoam
