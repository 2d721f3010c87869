// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask/mask_evidence.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Clusters nodes (regions, or all regions of an id) that the tracks show to be the same object,
// greedily by the greatest overlap. The overlap of two clusters is the intersection over union of
// their points, restricted to points that photos of both could see; so it does not depend on how
// often each was seen.
//
// `node_of_region` [regions of the evidence] is below `num_nodes`. Returns the cluster of each
// node, by one of its nodes. Deterministic.
std::vector<int32_t> ClusterNodes(const Evidence& evidence,
                                  const std::vector<int32_t>& node_of_region,
                                  int num_nodes);

}  // namespace semfoam
