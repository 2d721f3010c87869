// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Adds a component, a list of cells, to what is left out of an object. Reads the scene's geometry
// alone.
void LeaveOut(const ExportableScene& scene,
              const std::vector<uint32_t>& component,
              LeftOutComponents* left_out);

// Counts the connected components of every object, and takes out those that `options` do not want:
// first the ones with too few cells, then all but the largest. The cells of these belong to no
// object any more; an object that loses all of its components goes from `objects` to
// `labels_left_out`. Largest: by volume; of equals, the one with the lowest cell.
void KeepComponents(const ComponentOptions& options, ExportableScene* scene);

// Moves fragments from `objects` to `labels_left_out`: what is left in a foam of a label that the
// masks gave to parts of other things by mistake in a few photos. A fragment has both
// - less than a thousandth of the cells of all objects together, and
// - either a mean confidence (of the cells of its own class) below 0.85 times that of all objects,
//   because other photos say otherwise of its cells; or cells strewn over the scene: no connected
//   component holds 10 of them, nor half of them.
// Both are independent of the unit of length and the length of the training. A small thing that
// photos agree about and whose cells hang together is no fragment, not even with 3 cells: in a foam
// of few cells that is all that a small object gets. Expects the components of KeepComponents.
void LeaveOutFragments(ExportableScene* scene);

}  // namespace semfoam
