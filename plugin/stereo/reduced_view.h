// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/stereo/stereo_view.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// A view of fewer pixels, for what whole regions tell: the noise falls by the reduction.
struct ReducedView {
  StereoView view;
  // [pixels] 1: hardly any depth (at most an eighth) of the pixels behind this one is known, and
  // the photo shows all of them.
  std::vector<uint8_t> is_unknown;
};

// Returns the means of `reduction` x `reduction` pixels; pixels left over at the right and below
// are left out. `is_known` [pixels of `full`] says of which the depth is known.
ReducedView Reduce(const StereoView& full, const std::vector<uint8_t>& is_known, int reduction);

}  // namespace semfoam
