// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/mask/mask_evidence.h"

#include <vector>

namespace semfoam {

// Chooses the initial labels of the regions for the correction of masks, and the ids of the final
// labels.

struct RegionLabels {
  // Labels by the value of RegionLabel.
  std::vector<Label> labels;
  // [classes of the masks] Label of each; kNoLabel where a class has no label of its own.
  std::vector<RegionLabel> label_of_class;
  // [regions] Initial label of each.
  std::vector<RegionLabel> believed;
  // [regions] Original label of each in the masks. Differs from `believed` where ids were joined.
  std::vector<RegionLabel> given;
  // Whether labels[0] is that of id 0.
  bool has_zero_class = false;
};

// Keeps the masks' labels, for ids that mean the same object in all photos. Gives ids of the same
// object one label, that of the id with the most regions. Sets Region::label.
RegionLabels JoinIds(const std::vector<Label>& mask_labels, Evidence* evidence);

// Makes a label without id and name for each cluster of regions, for ids that are unrelated between
// photos, in the order of their first regions. Where id 0 is a class, its regions are one cluster,
// with the first label. Sets Region::label.
RegionLabels MatchRegions(const std::vector<Label>& mask_labels, Evidence* evidence);

// Numbers the labels of MatchRegions that still have regions, from 1 on, in their order. Throws
// FieldError of `mask_consistency` if there are more than kMaxMaskClasses.
void NumberLabels(const std::vector<Region>& regions, RegionLabels* labels);

}  // namespace semfoam
