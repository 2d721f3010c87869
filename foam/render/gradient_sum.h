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

// Groups the gradient records of a batch by cell, so that one thread can sum each cell in the order
// of the rays. Neither the groups nor their order depend on the number of threads.
class GradientSum {
 public:
  // Returns the records of each block of rays, in ray order. The thread that casts a block fills
  // its records.
  std::vector<std::vector<GradientRecord>>& blocks() { return blocks_; }

  // Groups the records of all blocks.
  void Group(uint32_t num_cells);

  // Returns the records of one cell, in ray order. Must be called after Group.
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
