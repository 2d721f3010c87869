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

// ThreadSanitizer cannot see how oneTBB, which is not built with it, hands a loop to its threads
// and waits for them, and would call every result of a loop a race. This tells it: what came before
// the loop happened before every block, and every block before what comes after the loop.
#ifdef __SANITIZE_THREAD__
extern "C" void __tsan_acquire(void* address);
extern "C" void __tsan_release(void* address);
class LoopOrder {
 public:
  LoopOrder() { __tsan_release(&begin_); }
  ~LoopOrder() { __tsan_acquire(&end_); }
  void BeginBlocks() { __tsan_acquire(&begin_); }
  void EndBlocks() { __tsan_release(&end_); }

 private:
  char begin_ = 0, end_ = 0;
};
#else
class LoopOrder {
 public:
  void BeginBlocks() {}
  void EndBlocks() {}
};
#endif

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
  LoopOrder order;
  tbb::parallel_for(
      tbb::blocked_range<int64_t>(0, num_blocks, 1),
      [&](const tbb::blocked_range<int64_t>& range) {
        order.BeginBlocks();
        for (int64_t block = range.begin(); block < range.end(); ++block) {
          body(block * block_size, std::min(count, (block + 1) * block_size));
        }
        order.EndBlocks();
      },
      tbb::simple_partitioner());
}

}  // namespace semfoam
