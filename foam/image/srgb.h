// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

namespace semfoam {

// Light from a display value (sRGB / 255) and back: the transfer function of IEC 61966-2-1. Both
// are in 0..1 where a display can show them; more than 1 goes on by the same formula.
template <typename T>
T LinearFromDisplay(T value) {
  return value <= T(0.04045) ? value / T(12.92) : std::pow((value + T(0.055)) / T(1.055), T(2.4));
}

template <typename T>
T DisplayFromLinear(T light) {
  return light <= T(0.0031308) ? T(12.92) * light
                               : T(1.055) * std::pow(light, T(1 / 2.4)) - T(0.055);
}

}  // namespace semfoam
