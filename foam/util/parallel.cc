// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/parallel.h"

#include <algorithm>
#include <memory>
#ifdef __SANITIZE_THREAD__
#include <atomic>
#include <exception>
#include <iterator>
#include <mutex>
#include <thread>
#include <vector>
#endif

#include <glog/logging.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>

namespace semfoam {
namespace {

#ifdef __SANITIZE_THREAD__
// ThreadSanitizer cannot see how oneTBB, which is not built with it, hands a loop to its threads
// and waits for them, and takes every result for a race. In its build plain threads run the loops,
// so that it sees what the bodies of loops do to each other.
void RunOnPlainThreads(int64_t num_blocks, const std::function<void(int64_t block)>& run) {
  std::atomic<int64_t> next = 0;
  std::mutex mutex;
  std::exception_ptr error;
  const auto work = [&] {
    try {
      for (int64_t block = next++; block < num_blocks; block = next++) run(block);
    } catch (...) {
      const std::lock_guard lock(mutex);
      error = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> threads;
    const int64_t num_threads = std::min<int64_t>(NumThreads(), num_blocks);
    while (std::ssize(threads) + 1 < num_threads) threads.emplace_back(work);
    work();
  }
  if (error) std::rethrow_exception(error);
}
#endif

}  // namespace

class ThreadLimit::Control {
 public:
  explicit Control(int num_threads)
      : control_(tbb::global_control::max_allowed_parallelism, num_threads) {}

 private:
  const tbb::global_control control_;
};

ThreadLimit::ThreadLimit(int num_threads) {
  CHECK(num_threads == -1 || num_threads >= 1) << num_threads;
  control_ = std::make_unique<const Control>(num_threads > 0 ? num_threads
                                                             : tbb::info::default_concurrency());
}

ThreadLimit::~ThreadLimit() = default;

int NumThreads() {
  return static_cast<int>(
      tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

void ParallelForBlocks(int64_t count,
                       int64_t block_size,
                       const std::function<void(int64_t begin, int64_t end)>& body) {
  CHECK_GT(block_size, 0);
  const int64_t num_blocks = (count + block_size - 1) / block_size;
  const auto run = [&](int64_t block) {
    body(block * block_size, std::min(count, (block + 1) * block_size));
  };
#ifdef __SANITIZE_THREAD__
  RunOnPlainThreads(num_blocks, run);
#else
  tbb::parallel_for(
      tbb::blocked_range<int64_t>(0, num_blocks, 1),
      [&](const tbb::blocked_range<int64_t>& range) {
        for (int64_t block = range.begin(); block < range.end(); ++block) run(block);
      },
      tbb::simple_partitioner());
#endif
}

}  // namespace semfoam
