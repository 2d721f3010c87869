// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/render/ray_loss.h"
#include "foam/render/ray_record.h"

#include <vector>

namespace semfoam {

// The arrays that rays read of a foam: its densities after the activation, its SH colours,
// identities and classifier.

// Returns the density of a cell that views show: the activated one, and at least the assumed one.
float ShownDensity(const Foam& foam, size_t site);

// Computes the shown densities of all cells, 0 for the guards: [num_sites + kNumGuardSites].
std::vector<float> CellDensities(const Foam& foam);

// Returns views of a foam and of its densities (CellDensities), which must outlive them.
inline CellShading<float> ShadingOf(const Foam& foam, const std::vector<float>& density) {
  return {foam.sh_degree,
          density.data(),
          foam.sh.data(),
          foam.HasSemantics() ? foam.identity.data() : nullptr,
          foam.HasColorGradients() ? foam.color_gradient.data() : nullptr};
}

// Returns a view of a foam's classifier, which must outlive it.
inline ClassifierView<float> ClassifierOf(const Foam& foam) {
  return {foam.num_classes, foam.classifier_weight.data(), foam.classifier_bias.data()};
}

}  // namespace semfoam
