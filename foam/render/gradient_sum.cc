// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/render/gradient_sum.h"

#include "foam/util/parallel.h"

#include <algorithm>

#include <glog/logging.h>

namespace semfoam {

// One pass over all cells would scatter its records over the whole memory and miss the cache at
// every record; hence the buckets.
void GradientSum::Distribute(uint32_t num_cells) {
  constexpr uint32_t kMaxBuckets = 256;
  num_cells_ = num_cells;
  shift_ = 0;
  while ((num_cells >> shift_) >= kMaxBuckets) ++shift_;
  const uint32_t num_buckets = (num_cells >> shift_) + 1;

  const size_t num_blocks = blocks_.size();
  // place[bucket][block]: where the block's records of that bucket begin.
  std::vector<uint32_t> place(num_buckets * num_blocks + 1, 0);
  ParallelForBlocks(num_blocks, 1, [&](int64_t block, int64_t) {
    for (const GradientRecord& record : blocks_[block]) {
      ++place[(record.contribution.cell >> shift_) * num_blocks + block];
    }
  });
  uint32_t total = 0;
  for (uint32_t& p : place) {
    const uint32_t count = p;
    p = total;
    total += count;
  }
  bucket_begin_.assign(num_buckets + 1, total);
  for (uint32_t b = 0; b < num_buckets; ++b) bucket_begin_[b] = place[b * num_blocks];

  scattered_.resize(total);
  ParallelForBlocks(num_blocks, 1, [&](int64_t block, int64_t) {
    for (const GradientRecord& record : blocks_[block]) {
      scattered_[place[(record.contribution.cell >> shift_) * num_blocks + block]++] = record;
    }
  });
}

// A counting sort, which is stable.
void GradientSum::Group(uint32_t bucket, Bucket* out) const {
  CHECK_LT(bucket, NumBuckets());
  const uint32_t first = std::min(num_cells_, bucket << shift_);
  const uint32_t last = std::min(num_cells_, first + (1u << shift_));
  const std::span records(scattered_.data() + bucket_begin_[bucket],
                          scattered_.data() + bucket_begin_[bucket + 1]);
  out->first_cell_ = first;
  out->last_cell_ = last;
  out->offsets_.assign(last - first + 1, 0);
  for (const GradientRecord& record : records) {
    ++out->offsets_[record.contribution.cell - first + 1];
  }
  for (size_t i = 1; i < out->offsets_.size(); ++i) out->offsets_[i] += out->offsets_[i - 1];
  out->next_.assign(out->offsets_.begin(), out->offsets_.end() - 1);
  if (out->sorted_.size() < records.size()) out->sorted_.resize(records.size());
  for (const GradientRecord& record : records) {
    out->sorted_[out->next_[record.contribution.cell - first]++] = record;
  }
}

}  // namespace semfoam
