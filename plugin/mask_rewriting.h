// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model.h"
#include "plugin/mask_evidence.h"
#include "plugin/masks.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Writes into the masks what their regions were found to be: each pixel gets its region's label; of
// a split region, that of the points clearly nearest to it, or none. Held-out photos have no
// regions; `label_of_class` [classes of the masks] is for them, kNoLabel = unlabelled.
//
// `labels` are all that regions refer to. Those that no region has are left out of the masks'
// labels; the order of the others remains. Returns the class that each label has become,
// kUnlabelled where it is left out.
std::vector<int32_t> RewriteMasks(const Evidence& evidence,
                                  const std::vector<PhotoRecord>& photos,
                                  const std::vector<int32_t>& label_of_class,
                                  std::vector<Label> labels,
                                  MaskSet* masks);

}  // namespace semfoam
