// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/cuda/batch_kernels.h"
#include "foam/device/cuda/gpu_scene.h"
#include "foam/device/cuda/update_kernels.h"
#include "foam/optim/training_device.h"

#include <bit>
#include <cstdint>
#include <vector>

#include <glog/logging.h>

namespace semfoam {

// Casts a batch of rays on a GPU, forward and backward, and sorts their contributions by cell.
// Holds one batch at a time; the arrays are reused from batch to batch.
//
// The gradients of a batch are summed in the order of the rays, whatever the scheduling of the
// threads: each ray writes its contributions to a pool, these are listed in the order of the rays,
// sorted by cell (stably), and each cell sums its own. So the bytes of a result depend on the input
// and the kind of GPU alone.
template <typename Machine>
class GpuBatch {
 public:
  template <typename T>
  using Array = typename Machine::template Array<T>;

  // Casts the rays of a step and writes their contributions to the pool.
  void Cast(Machine& machine,
            const TrainingStep& step,
            const WalkView<float>& geometry,
            const CellShading<float>& shading,
            const ClassifierView<float>& classifier,
            const ParameterRow& row) {
    const uint32_t num_rays = static_cast<uint32_t>(step.rays.size());
    const bool has_semantics = classifier.num_classes > 0;
    CHECK_LT(num_rays, uint32_t{1} << 29);  // Slot::bits
    SendTo(machine, step.rays, &rays_);
    outputs_.Resize(num_rays);
    samples_.Resize(has_semantics ? num_rays : 0);
    tallies_.Resize(num_rays);
    taken_.Resize(1);
    // Most rays cross some 50 cells.
    if (chunks_.size() == 0) ResizePool(3 * num_rays);
    while (true) {
      machine.Clear(&taken_);
      machine.ForEach(num_rays,
                      CastRay{geometry,
                              shading,
                              classifier,
                              step.weights,
                              step.cutoff_tau,
                              row,
                              num_rays,
                              rays_.data(),
                              Pool(),
                              outputs_.data(),
                              has_semantics ? samples_.data() : nullptr,
                              tallies_.data()});
      uint32_t taken = 0;
      machine.Download(taken_, 1, &taken);
      if (taken <= chunks_.size()) return;
      // Rays that overflowed the pool have stopped, so they may need more than they requested.
      ResizePool(taken + taken / 4);
    }
  }

  // Returns the batch's totals, and the number of contributions in `num_contributions`. Must be
  // called after Cast.
  BatchTotals FetchTotals(Machine& machine, int64_t* num_contributions) {
    const auto num_rays = static_cast<int64_t>(tallies_.size());
    tally_sums_.Resize((num_rays + kRaysPerTally - 1) / kRaysPerTally);
    machine.ForEach(tally_sums_.size(), SumTallies{tallies_.data(), num_rays, tally_sums_.data()});
    std::vector<TallySum> sums;
    FetchFrom(machine, tally_sums_, &sums);
    BatchTotals totals;
    *num_contributions = 0;
    for (const TallySum& sum : sums) {
      totals.mean_loss += sum.loss / static_cast<double>(num_rays);
      totals.step_limit_hits += sum.step_limit_hits;
      totals.num_segments += sum.num_segments;
      totals.clamped_segments += sum.clamped_segments;
      *num_contributions += sum.num_contributions;
    }
    CHECK_LT(*num_contributions, int64_t{1} << 32);
    return totals;
  }

  // Sorts all `count` contributions by cell.
  void SortContributions(Machine& machine, uint32_t num_sites, int64_t count) {
    const size_t num_rays = tallies_.size();
    counts_.Resize(num_rays);
    first_.Resize(num_rays);
    cells_.Resize(count);
    order_.Resize(count);
    machine.ForEach(num_rays, CountContributions{tallies_.data(), counts_.data()});
    machine.SumBefore(counts_, num_rays, &first_);
    machine.ForEach(
        num_rays,
        ListContributions{Pool(), tallies_.data(), first_.data(), cells_.data(), order_.data()});
    machine.SortPairs(count, std::bit_width(num_sites), &cells_, &order_);
    begin_.Resize(num_sites);
    end_.Resize(num_sites);
    machine.Clear(&begin_);
    machine.Clear(&end_);
    machine.ForEach(count, FindRuns{cells_.data(), count, begin_.data(), end_.data()});
  }

  // Returns the sorted contributions. Valid after SortContributions until the next Cast.
  CellContributions Contributions() const {
    return {slots_.data(), order_.data(), begin_.data(), end_.data(), outputs_.data()};
  }

  // Returns the training samples of the classifier, one per ray; empty without semantics. Valid
  // after Cast.
  const Array<ClassSample>& samples() const { return samples_; }

 private:
  SegmentPool Pool() {
    return {slots_.data(), chunks_.data(), taken_.data(), static_cast<uint32_t>(chunks_.size())};
  }
  void ResizePool(uint32_t num_chunks) {
    CHECK_LT(num_chunks, ~0u / kSlotsPerChunk);
    chunks_.Resize(num_chunks);
    slots_.Resize(size_t{num_chunks} * kSlotsPerChunk);
  }

  Array<BatchRay> rays_;
  Array<RayOutput> outputs_;
  Array<ClassSample> samples_;
  Array<RayTally> tallies_;
  Array<TallySum> tally_sums_;
  Array<Slot> slots_;
  Array<uint32_t> chunks_;  // SegmentPool::previous
  Array<uint32_t> taken_;
  Array<uint32_t> counts_, first_, cells_, order_, begin_, end_;
};

}  // namespace semfoam
