// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

namespace semfoam {

// Limits the number of threads of every parallel loop of the process while it exists, those of
// libraries that use oneTBB included. If several limits exist, the smallest applies.
class ThreadLimit {
 public:
  // Sets the maximum number of threads: at least 1, or -1 for the number of cores (CHECK).
  explicit ThreadLimit(int num_threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  class Control;  // of oneTBB
  std::unique_ptr<const Control> control_;
};

// Returns the maximum number of threads of a parallel loop.
int NumThreads();

// Calls body(begin, end) for the blocks [0, block), [block, 2 block), ... of [0, count), in
// parallel and in no given order. The blocks depend on `block_size` alone, never on the threads: a
// caller that keeps one partial result per block and adds them up in block order gets the same
// bytes on any number of threads.
void ParallelForBlocks(int64_t count,
                       int64_t block_size,
                       const std::function<void(int64_t begin, int64_t end)>& body);

}  // namespace semfoam
