// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/render/gradient_sum.h"

#include "foam/util/parallel.h"

#include <algorithm>

#include <glog/logging.h>

namespace semfoam {

void GradientSum::Group(uint32_t num_cells) {
  // Two stable passes: into some 256 buckets of neighbouring cells, then within each bucket by
  // cell. One pass would scatter over all cells and miss the cache at every record.
  constexpr uint32_t kMaxBuckets = 256;
  uint32_t shift = 0;
  while ((num_cells >> shift) >= kMaxBuckets) ++shift;
  const uint32_t num_buckets = (num_cells >> shift) + 1;

  const size_t num_blocks = blocks_.size();
  // place[bucket][block]: where the block's records of that bucket begin.
  std::vector<uint32_t> place(num_buckets * num_blocks + 1, 0);
  ParallelForBlocks(num_blocks, 1, [&](int64_t block, int64_t) {
    for (const GradientRecord& record : blocks_[block]) {
      ++place[(record.contribution.cell >> shift) * num_blocks + block];
    }
  });
  uint32_t total = 0;
  for (uint32_t& p : place) {
    const uint32_t count = p;
    p = total;
    total += count;
  }
  std::vector<uint32_t> bucket_begin(num_buckets + 1, total);
  for (uint32_t b = 0; b < num_buckets; ++b) bucket_begin[b] = place[b * num_blocks];

  scattered_.resize(total);
  sorted_.resize(total);
  offsets_.resize(num_cells + 1);
  ParallelForBlocks(num_blocks, 1, [&](int64_t block, int64_t) {
    for (const GradientRecord& record : blocks_[block]) {
      scattered_[place[(record.contribution.cell >> shift) * num_blocks + block]++] = record;
    }
  });
  ParallelForBlocks(num_buckets, 1, [&](int64_t bucket, int64_t) {
    const uint32_t first_cell = static_cast<uint32_t>(bucket) << shift;
    const uint32_t last_cell = std::min(num_cells, first_cell + (1u << shift));
    if (first_cell >= last_cell) return;
    std::vector<uint32_t> next(last_cell - first_cell + 1, 0);
    for (uint32_t i = bucket_begin[bucket]; i < bucket_begin[bucket + 1]; ++i) {
      ++next[scattered_[i].contribution.cell - first_cell];
    }
    uint32_t begin = bucket_begin[bucket];
    for (uint32_t cell = first_cell; cell < last_cell; ++cell) {
      const uint32_t count = next[cell - first_cell];
      offsets_[cell] = next[cell - first_cell] = begin;
      begin += count;
    }
    for (uint32_t i = bucket_begin[bucket]; i < bucket_begin[bucket + 1]; ++i) {
      sorted_[next[scattered_[i].contribution.cell - first_cell]++] = scattered_[i];
    }
  });
  offsets_[num_cells] = total;
}

}  // namespace semfoam
