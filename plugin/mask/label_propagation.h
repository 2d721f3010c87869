// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask/mask_evidence.h"

#include <vector>

namespace semfoam {

// Propagates labels along the links of the evidence until each region has the label that the other
// photos vote for, is split among several, or is dropped.

// Judges the regions in several rounds, the clear ones first, because their correction may clarify
// others. Then drops regions of labels that few photos have and no point confirms: fragments, or
// objects that cannot be learned.
//
// `believed` [regions] are the initial labels of the regions, below `num_labels`. Sets label, parts
// and is_judged of the regions, and label and verdict of the observations. Returns for each region
// whether it was dropped because its points contradict it.
std::vector<char> PropagateLabels(const std::vector<RegionLabel>& believed,
                                  int num_labels,
                                  Evidence* evidence);

}  // namespace semfoam
