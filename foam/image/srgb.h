// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

namespace semfoam {

// Convert display values (sRGB / 255) to linear light and back by the transfer function of IEC
// 61966-2-1. Both are in 0..1 for colours that a display can show; the same formula is used above
// 1.
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
