// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/mask/mask_evidence.h"

#include <vector>

namespace semfoam {

// The labels that the regions of the evidence refer to while masks are corrected: which ones the
// regions begin with, and which ids they get in the end.

struct RegionLabels {
  // Labels by the value of RegionLabel.
  std::vector<Label> labels;
  // [classes of the masks] Label of each; kNoLabel where a class has no label of its own.
  std::vector<RegionLabel> label_of_class;
  // [regions] Label that each begins with.
  std::vector<RegionLabel> believed;
  // [regions] Label that the masks gave to each. Differs from `believed` where ids were joined.
  std::vector<RegionLabel> given;
  // Whether labels[0] is that of id 0.
  bool has_zero_class = false;
};

// For ids that mean the same in all photos: keeps the masks' labels, and gives ids that are the
// same thing one label, that of the id with the most regions. Sets Region::label.
RegionLabels JoinIds(const std::vector<Label>& mask_labels, Evidence* evidence);

// For ids that mean nothing between photos: makes a label without id and name for each cluster of
// regions, in the order of their first regions. Regions of id 0 stay together where it is a class,
// with its label in the first place. Sets Region::label.
RegionLabels MatchRegions(const std::vector<Label>& mask_labels, Evidence* evidence);

// Numbers the labels of MatchRegions that regions still have from 1 on, in their order. Throws
// FieldError of `mask_consistency` where they are more than kMaxMaskClasses.
void NumberLabels(const std::vector<Region>& regions, RegionLabels* labels);

}  // namespace semfoam
