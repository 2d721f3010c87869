// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "foam/util/ids.h"
#include "plugin/mask/mask_consistency.h"
#include "plugin/mask/mask_evidence.h"
#include "plugin/mask/region_labels.h"

#include <vector>

namespace semfoam {

// Reports the correction of each region.

// Logs (VLOG 1) each region whose label is not the one that the masks gave. `mask_labels` are those
// of the masks' classes.
void LogChangedRegions(const Evidence& evidence,
                       const std::vector<PhotoRecord>& photos,
                       const std::vector<Label>& mask_labels,
                       const RegionLabels& labels);

// Counts split, dropped and unjudged regions in `report`.
void CountRegions(const std::vector<Region>& regions, MaskConsistencyReport* report);

// Returns a report of each region. `is_contradicted` [regions] is that of PropagateLabels, and
// `class_of_label` [labels] that of MaskRewriter.
std::vector<RegionReport> ReportRegions(const Evidence& evidence,
                                        const RegionLabels& labels,
                                        const std::vector<char>& is_contradicted,
                                        const std::vector<ClassIndex>& class_of_label);

}  // namespace semfoam
