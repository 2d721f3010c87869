// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/render/ray_record.h"

#include <cstdint>
#include <span>
#include <vector>

namespace semfoam {

// A CellContribution of one ray of a batch.
struct GradientRecord {
  uint32_t ray;  // index in the batch
  CellContribution<float> contribution;
};

// The one place where the rays of a batch meet the cells: groups the batch's records by cell, so
// that every cell can be summed up by one thread, in the order of the rays. Neither the groups nor
// their order depend on the number of threads.
class GradientSum {
 public:
  // The records of one block of rays, to be filled by the thread that casts the block; blocks are
  // in ray order.
  std::vector<std::vector<GradientRecord>>& blocks() { return blocks_; }

  // Groups the records of all blocks.
  void Group(uint32_t num_cells);

  // After Group: the records of one cell, in ray order.
  std::span<const GradientRecord> Of(uint32_t cell) const {
    return {sorted_.data() + offsets_[cell], sorted_.data() + offsets_[cell + 1]};
  }
  size_t NumRecords() const { return sorted_.size(); }

 private:
  std::vector<std::vector<GradientRecord>> blocks_;
  std::vector<GradientRecord> scattered_;  // by bucket of cells
  std::vector<GradientRecord> sorted_;     // by cell
  std::vector<uint32_t> offsets_;          // [num_cells + 1]
};

}  // namespace semfoam
