// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/render/block_exchange.h"

#include "foam/util/parallel.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include <glog/logging.h>

namespace semfoam {
namespace {

// A rank sends a BlockHeader for each of its blocks, and then, block by block: the classifier's
// gradients, a row of each ray (RayOutput::parameters), the number of each ray's records, and
// these.
struct BlockHeader {
  int64_t num_records = 0;
  int64_t step_limit_hits = 0;
  int64_t num_segments = 0;
  int64_t clamped_segments = 0;
  RayLossTerms<double> loss;
};
static_assert(std::is_trivially_copyable_v<BlockHeader>);

// A GradientRecord as it is sent: its ray follows from the place, and the channels take three bits
// of the cell.
struct SentRecord {
  uint32_t cell_and_channels;
  float weight;
  float density;
  float position[3];
  float centroid;

  SentRecord() = default;
  explicit SentRecord(const CellContribution<float>& c)
      : cell_and_channels(c.cell + c.color_mask * kMostCellsToExchange),
        weight(c.weight),
        density(c.density),
        position{c.position.x(), c.position.y(), c.position.z()},
        centroid(c.centroid) {}

  CellContribution<float> Contribution() const {
    return {cell_and_channels % kMostCellsToExchange,
            cell_and_channels / kMostCellsToExchange,
            weight,
            density,
            {position[0], position[1], position[2]},
            centroid};
  }
};
static_assert(std::is_trivially_copyable_v<SentRecord> && sizeof(SentRecord) == 28);

// The sizes that all ranks know.
struct BlockShape {
  int64_t num_rays;
  int64_t block_size;
  size_t class_floats;
  size_t row_floats;

  int64_t First(int64_t block) const { return block * block_size; }
  int64_t Last(int64_t block) const { return std::min(num_rays, (block + 1) * block_size); }
  size_t BytesOf(int64_t block, int64_t num_records) const {
    const size_t num_rays_of_block = Last(block) - First(block);
    return (class_floats + row_floats * num_rays_of_block) * sizeof(float) +
           num_rays_of_block * sizeof(uint32_t) + num_records * sizeof(SentRecord);
  }
};

// Copies `count` values to `*to`, and moves that behind them.
template <typename T>
void Put(const T* values, size_t count, std::byte** to) {
  if (count > 0) std::memcpy(*to, values, count * sizeof(T));
  *to += count * sizeof(T);
}

// Does the opposite.
template <typename T>
void Take(size_t count, const std::byte** from, T* values) {
  if (count > 0) std::memcpy(values, *from, count * sizeof(T));
  *from += count * sizeof(T);
}

void WriteBlock(const BlockShape& shape,
                int64_t block,
                const BlockSums& sums,
                const LargePageVector<RayOutput>& rays,
                const std::vector<GradientRecord>& records,
                std::byte* to) {
  Put(sums.weight_gradient.data(), sums.weight_gradient.size(), &to);
  Put(sums.bias_gradient.data(), sums.bias_gradient.size(), &to);
  for (int64_t i = shape.First(block); i < shape.Last(block); ++i) {
    Put(rays[i].parameters, shape.row_floats, &to);
  }
  auto record = records.begin();
  for (int64_t i = shape.First(block); i < shape.Last(block); ++i) {
    const auto next = std::find_if(
        record, records.end(), [&](const GradientRecord& r) { return r.ray != uint32_t(i); });
    const auto count = static_cast<uint32_t>(next - record);
    Put(&count, 1, &to);
    record = next;
  }
  for (const GradientRecord& r : records) {
    const SentRecord sent(r.contribution);
    Put(&sent, 1, &to);
  }
}

void ReadBlock(const BlockShape& shape,
               int64_t block,
               const BlockHeader& header,
               const std::vector<BatchRay>& rays,
               int num_classes,
               const std::byte* from,
               BlockSums* sums,
               BatchResult* result) {
  sums->Clear(num_classes);
  sums->loss = header.loss;
  sums->step_limit_hits = header.step_limit_hits;
  sums->num_segments = header.num_segments;
  sums->clamped_segments = header.clamped_segments;
  Take(sums->weight_gradient.size(), &from, sums->weight_gradient.data());
  Take(sums->bias_gradient.size(), &from, sums->bias_gradient.data());
  for (int64_t i = shape.First(block); i < shape.Last(block); ++i) {
    RayOutput& ray = result->rays[i];
    Take(shape.row_floats, &from, ray.parameters);
    ray.origin = rays[i].origin;
    ray.direction = rays[i].direction;
  }
  auto& records = result->gradients.blocks()[block];
  records.clear();
  const std::byte* counts = from;
  from += (shape.Last(block) - shape.First(block)) * sizeof(uint32_t);
  for (int64_t i = shape.First(block); i < shape.Last(block); ++i) {
    uint32_t count = 0;
    Take(1, &counts, &count);
    for (uint32_t k = 0; k < count; ++k) {
      SentRecord sent;
      Take(1, &from, &sent);
      records.push_back({static_cast<uint32_t>(i), sent.Contribution()});
    }
  }
  CHECK_EQ(std::ssize(records), header.num_records);
}

}  // namespace

BlockRange BlocksOfRank(int64_t num_blocks, int rank, int num_ranks) {
  return {num_blocks * rank / num_ranks, num_blocks * (rank + 1) / num_ranks};
}

void ExchangeBlocks(const std::vector<BatchRay>& rays,
                    int64_t block_size,
                    int num_classes,
                    const ParameterRow& row,
                    RankGroup* ranks,
                    std::vector<BlockSums>* sums,
                    BatchResult* result) {
  const auto num_blocks = std::ssize(result->gradients.blocks());
  const BlockShape shape{std::ssize(rays),
                         block_size,
                         size_t(num_classes) * (kIdentityDim + 1),
                         static_cast<size_t>(row.size)};
  const auto blocks_of = [&](int rank) {
    return BlocksOfRank(num_blocks, rank, ranks->num_ranks());
  };
  // Where each block begins in what a rank sends; at the end, its length.
  const auto offsets = [&](const BlockRange& blocks, const std::vector<BlockHeader>& headers) {
    std::vector<size_t> begin = {headers.size() * sizeof(BlockHeader)};
    for (int64_t block = blocks.first; block < blocks.last; ++block) {
      begin.push_back(begin.back() +
                      shape.BytesOf(block, headers[block - blocks.first].num_records));
    }
    return begin;
  };

  const BlockRange own = blocks_of(ranks->rank());
  std::vector<BlockHeader> headers;
  for (int64_t block = own.first; block < own.last; ++block) {
    const BlockSums& of_block = (*sums)[block];
    headers.push_back({std::ssize(result->gradients.blocks()[block]),
                       of_block.step_limit_hits,
                       of_block.num_segments,
                       of_block.clamped_segments,
                       of_block.loss});
  }
  const std::vector<size_t> begin = offsets(own, headers);
  result->sent.resize(begin.back());
  std::byte* to = result->sent.data();
  Put(headers.data(), headers.size(), &to);
  ParallelForBlocks(own.last - own.first, 1, [&](int64_t k, int64_t) {
    const int64_t block = own.first + k;
    WriteBlock(shape,
               block,
               (*sums)[block],
               result->rays,
               result->gradients.blocks()[block],
               result->sent.data() + begin[k]);
  });

  const auto received = ranks->Gather(result->sent);
  for (int rank = 0; rank < ranks->num_ranks(); ++rank) {
    if (rank == ranks->rank()) continue;
    const BlockRange blocks = blocks_of(rank);
    std::vector<BlockHeader> of_blocks(blocks.last - blocks.first);
    const std::byte* from = received[rank].data();
    CHECK_GE(received[rank].size(), of_blocks.size() * sizeof(BlockHeader));
    Take(of_blocks.size(), &from, of_blocks.data());
    const std::vector<size_t> begins = offsets(blocks, of_blocks);
    CHECK_EQ(received[rank].size(), begins.back());
    ParallelForBlocks(blocks.last - blocks.first, 1, [&](int64_t k, int64_t) {
      const int64_t block = blocks.first + k;
      ReadBlock(shape,
                block,
                of_blocks[k],
                rays,
                num_classes,
                received[rank].data() + begins[k],
                &(*sums)[block],
                result);
    });
  }
}

}  // namespace semfoam
