// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/render/ray_record.h"
#include "foam/util/large_pages.h"

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
// of the rays: first all of them into buckets of neighbouring cells, then, where the thread that
// sums a bucket has it in its cache, those of the bucket by cell. Neither the groups nor their
// order depend on the number of threads.
class GradientSum {
 public:
  // The records of the cells [first_cell, last_cell), grouped by cell. Reused from bucket to
  // bucket, so that memory is allocated only while the arrays still grow.
  class Bucket {
   public:
    uint32_t first_cell() const { return first_cell_; }
    uint32_t last_cell() const { return last_cell_; }
    // Returns the records of one of these cells, in ray order.
    std::span<const GradientRecord> Of(uint32_t cell) const {
      const size_t i = cell - first_cell_;
      return {sorted_.data() + offsets_[i], sorted_.data() + offsets_[i + 1]};
    }

   private:
    friend class GradientSum;

    uint32_t first_cell_ = 0, last_cell_ = 0;
    std::vector<GradientRecord> sorted_;
    std::vector<uint32_t> offsets_;  // [number of cells + 1]
    std::vector<uint32_t> next_;     // [number of cells]
  };

  // Returns the records of each block of rays, in ray order. The thread that casts a block fills
  // its records.
  std::vector<std::vector<GradientRecord>>& blocks() { return blocks_; }

  // Distributes the records of all blocks, whose cells are below `num_cells`, over the buckets.
  void Distribute(uint32_t num_cells);

  // Number of buckets, which together hold each cell once. Must be called after Distribute.
  uint32_t NumBuckets() const { return static_cast<uint32_t>(bucket_begin_.size() - 1); }

  // Groups the records of one bucket by cell. Must be called after Distribute; may be called from
  // several threads at a time.
  void Group(uint32_t bucket, Bucket* out) const;

  size_t NumRecords() const { return scattered_.size(); }

 private:
  std::vector<std::vector<GradientRecord>> blocks_;
  LargePageVector<GradientRecord> scattered_;  // by bucket
  std::vector<uint32_t> bucket_begin_;         // [number of buckets + 1]
  uint32_t num_cells_ = 0;
  uint32_t shift_ = 0;  // a bucket has 2^shift_ cells
};

}  // namespace semfoam
