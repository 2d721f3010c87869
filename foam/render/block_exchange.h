// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/render/block_sums.h"
#include "foam/render/ray_batch.h"
#include "foam/util/rank_group.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Blocks of rays of a batch, [first, last).
struct BlockRange {
  int64_t first = 0;
  int64_t last = 0;
};

// Returns the blocks that a rank casts: as many as any other, or one more or less. Ranks beyond the
// number of blocks have none.
BlockRange BlocksOfRank(int64_t num_blocks, int rank, int num_ranks);

// Number of cells of a foam whose records can be sent.
inline constexpr uint32_t kMostCellsToExchange = 1u << 29;

// Sends to all other ranks what this one has computed of its blocks of a batch (BlocksOfRank), and
// receives the rest: the records and the rays of `result`, and `sums` [number of blocks]. All have
// their final sizes. A ray's row in `result` has the length of `row`. Throws LostRank.
void ExchangeBlocks(const std::vector<BatchRay>& rays,
                    int64_t block_size,
                    int num_classes,
                    const ParameterRow& row,
                    RankGroup* ranks,
                    std::vector<BlockSums>* sums,
                    BatchResult* result);

}  // namespace semfoam
