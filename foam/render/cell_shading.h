// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_record.h"

#include <vector>

namespace semfoam {

// Activated densities of all cells, 0 for the guards: [num_sites + kNumGuardSites].
std::vector<float> CellDensities(const Foam& foam);

// A foam and its densities as rays see them. Borrowed.
inline CellShading<float> ShadingOf(const Foam& foam, const std::vector<float>& density) {
  return {foam.sh_degree,
          density.data(),
          foam.sh.data(),
          foam.HasSemantics() ? foam.identity.data() : nullptr};
}
inline ClassifierView<float> ClassifierOf(const Foam& foam) {
  return {foam.num_classes, foam.classifier_weight.data(), foam.classifier_bias.data()};
}

}  // namespace semfoam
