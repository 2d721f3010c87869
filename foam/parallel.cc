// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/parallel.h"

#include <algorithm>
#include <memory>

#include <glog/logging.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>

namespace semfoam {
namespace {

std::unique_ptr<tbb::global_control> thread_limit;

}  // namespace

void SetNumThreads(int num_threads) {
  const int cores = tbb::info::default_concurrency();
  thread_limit.reset();
  thread_limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                       num_threads > 0 ? num_threads : cores);
}

int NumThreads() {
  return static_cast<int>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

void ParallelForBlocks(int64_t count,
                       int64_t block_size,
                       const std::function<void(int64_t begin, int64_t end)>& body) {
  CHECK_GT(block_size, 0);
  const int64_t num_blocks = (count + block_size - 1) / block_size;
  tbb::parallel_for(
      tbb::blocked_range<int64_t>(0, num_blocks, 1),
      [&](const tbb::blocked_range<int64_t>& range) {
        for (int64_t block = range.begin(); block < range.end(); ++block) {
          body(block * block_size, std::min(count, (block + 1) * block_size));
        }
      },
      tbb::simple_partitioner());
}

}  // namespace semfoam
