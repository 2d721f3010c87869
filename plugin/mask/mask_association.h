// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask/mask_evidence.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Joins what the tracks say is the same: nodes (regions, or the regions of an id) are clustered
// greedily, those of the greatest overlap first. The overlap of two clusters is the intersection
// over union of their points as far as both have photos that could see them; so it does not matter
// how often each was seen.
//
// `node_of_region` [regions of the evidence] is below `num_nodes`. Returns the cluster of each
// node, by one of its nodes. Deterministic.
std::vector<int32_t> ClusterNodes(const Evidence& evidence,
                                  const std::vector<int32_t>& node_of_region,
                                  int num_nodes);

}  // namespace semfoam
