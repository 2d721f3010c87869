// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/benchmark/stream_copy.h"

#include <algorithm>
#include <barrier>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <thread>
#include <vector>

namespace semfoam {

double StreamCopyBytesPerSecond(int num_threads) {
  constexpr size_t kBytes = size_t{256} << 20;
  constexpr int kTimes = 8;
  const std::vector<char> source(kBytes, 1);
  std::vector<char> target(kBytes, 0);
  std::barrier together(num_threads);
  double best = 0;
  const auto copy_share = [&](int thread) {
    const size_t begin = kBytes / num_threads * thread, count = kBytes / num_threads;
    for (int time = 0; time < kTimes; ++time) {
      together.arrive_and_wait();
      const auto start = std::chrono::steady_clock::now();
      std::memcpy(target.data() + begin, source.data() + begin, count);
      together.arrive_and_wait();
      const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
      if (thread == 0) best = std::max(best, 2.0 * count * num_threads / elapsed.count());
    }
  };
  std::vector<std::jthread> others;
  for (int thread = 1; thread < num_threads; ++thread) others.emplace_back(copy_share, thread);
  copy_share(0);
  return best;
}

}  // namespace semfoam
