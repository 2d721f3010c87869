// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include <benchmark/benchmark.h>

namespace semfoam {

// Cases are registered under their plain name for 1 thread and with "/threads:2" for 2. Both are
// timed by the wall clock, with Stopwatch: Google Benchmark computes rates from CPU time, unless a
// case is renamed to ".../real_time".

inline constexpr int kThreadCounts[] = {1, 2};

// Registers a case whose threads each run `body` on their own share of the work.
void RegisterSharedCase(const std::string& name,
                        const std::function<void(benchmark::State& state)>& body);

// Registers a case that one thread runs, and whose parallel loops (foam/util/parallel.h) run on
// `num_threads`: `body` sets a ThreadLimit once its inputs are made.
void RegisterParallelCase(
    const std::string& name,
    const std::function<void(benchmark::State& state, int num_threads)>& body);

// Sums the wall-clock time of several scopes.
class Stopwatch {
 public:
  class Lap {
   public:
    explicit Lap(Stopwatch* watch) : watch_(watch), begin_(Clock::now()) {}
    ~Lap() { watch_->seconds_ += std::chrono::duration<double>(Clock::now() - begin_).count(); }
    Lap(const Lap&) = delete;

   private:
    using Clock = std::chrono::steady_clock;
    Stopwatch* const watch_;
    const Clock::time_point begin_;
  };

  double seconds() const { return seconds_; }

 private:
  double seconds_ = 0;
};

// Calls body(begin, end) for this thread's share of [0, count), a few thousand at a time: blocks
// are dealt to the threads in turn, so that each gets cheap and expensive parts of a picture.
template <typename Body>
void ForOwnShare(const benchmark::State& state, int64_t count, Body&& body) {
  constexpr int64_t kTurn = 4096;
  for (int64_t begin = kTurn * state.thread_index(); begin < count;
       begin += kTurn * state.threads()) {
    body(begin, std::min(count, begin + kTurn));
  }
}

// Returns the rate of `amount` of work in all of this thread's laps; the rates of the threads are
// summed.
inline benchmark::Counter Rate(double amount, const Stopwatch& watch) {
  return benchmark::Counter(amount / watch.seconds());
}

// Returns a counter that has the same value in every thread.
inline benchmark::Counter Same(double value) {
  return benchmark::Counter(value, benchmark::Counter::kAvgThreads);
}

}  // namespace semfoam
