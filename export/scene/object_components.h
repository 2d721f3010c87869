// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Adds a component, a list of cells, to the components left out of an object. Reads only the
// scene's geometry.
void LeaveOut(const ExportableScene& scene,
              const std::vector<uint32_t>& component,
              LeftOutComponents* left_out);

// Counts the connected components of `cells`.
int64_t CountComponents(const ExportableScene& scene, const std::vector<uint32_t>& cells);

// Counts the connected components of every object, and removes those that `options` exclude: first
// the ones with too few cells, then all but the largest. Their cells belong to no object; an object
// that loses all of its components is moved from `objects` to `labels_left_out`. The largest is the
// one of the largest volume; of equals, the one with the lowest cell.
void KeepComponents(const ComponentOptions& options, ExportableScene* scene);

// A fragment has fewer cells than this share of those of all objects together.
inline constexpr double kFragmentShare = 1e-3;
// A fragment of connected cells has a mean confidence below this share of that of all objects.
inline constexpr double kFragmentConfidence = 0.85;

// Moves fragments from `objects` to `labels_left_out`: the cells of a label that the masks gave to
// parts of other objects by mistake in a few photos. A fragment has both
// - less than kFragmentShare of the cells of all objects together, and
// - either a mean confidence (of its own class's cells) below kFragmentConfidence of all objects',
//   because other photos contradict its cells; or cells scattered over the scene: no connected
//   component has 10 of them, or half of them; or a single cell, which has no shape.
// Both are independent of the unit of length and the length of the training. A small object on
// which the photos agree and whose cells are connected is no fragment, even with 3 cells: in a foam
// of few cells a small object has no more. Must be called after KeepComponents.
void LeaveOutFragments(ExportableScene* scene);

}  // namespace semfoam
