// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// What is known of a connected component without its cells; normalised frame.
struct ComponentMeasures {
  int64_t cells = 0;
  double volume = 0;
  // Sum of its sites, weighted by volume.
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  // The site of one of its cells.
  Eigen::Vector3d site = Eigen::Vector3d::Zero();
};

// Mean confidence of cells, over those of an object's own class.
struct MeanConfidence {
  double sum = 0;
  int64_t count = 0;

  double Value() const { return count > 0 ? sum / static_cast<double>(count) : 0; }
  void Add(const MeanConfidence& other) {
    sum += other.sum;
    count += other.count;
  }
};

// Adds a component to the components left out of an object. Reads only the scene's frames.
void LeaveOut(const ExportableScene& scene,
              const ComponentMeasures& component,
              LeftOutComponents* left_out);

// Does the same for a list of cells. Reads only the scene's geometry.
void LeaveOut(const ExportableScene& scene,
              const std::vector<uint32_t>& component,
              LeftOutComponents* left_out);

// Counts the connected components of `cells`.
int64_t CountComponents(const ExportableScene& scene, const std::vector<uint32_t>& cells);

// Returns whether `options` keep a component of so many cells, after `kept` larger ones of its
// object.
bool IsKept(const ComponentOptions& options, int64_t cells, int64_t kept);
// The reason for an object of which they keep none.
inline constexpr char kTooFewCells[] = "too few cells in every piece";

// Counts the connected components of every object, and removes those that `options` exclude: first
// the ones with too few cells, then all but the largest. Their cells belong to no object; an object
// that loses all of its components is moved from `objects` to `labels_left_out`. The largest is the
// one of the largest volume; of equals, the one with the lowest cell.
void KeepComponents(const ComponentOptions& options, ExportableScene* scene);

// A fragment has fewer cells than this share of those of all objects together.
inline constexpr double kFragmentShare = 1e-3;
// A fragment of connected cells has a mean confidence below this share of that of all objects.
inline constexpr double kFragmentConfidence = 0.85;

// What decides whether an object is a fragment.
struct FragmentEvidence {
  // Number of cells, also of its largest connected component.
  int64_t cells = 0;
  int64_t largest = 0;
  // Mean over the cells of its own class.
  double confidence = 0;
};

// Returns the reason why an object is a fragment, by the rule of LeaveOutFragments; empty: it is
// none. `all_cells` and `all_confidence` are those of all objects together.
std::string FragmentReason(const FragmentEvidence& object,
                           int64_t all_cells,
                           double all_confidence);

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
