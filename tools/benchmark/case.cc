// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/benchmark/case.h"

namespace semfoam {
namespace {

void Register(const std::string& name,
              int benchmark_threads,
              const std::function<void(benchmark::State&)>& body) {
  auto* const registered = benchmark::RegisterBenchmark(name.c_str(), body);
  registered->Unit(benchmark::kMillisecond);
  // Not for one thread: that would add "/threads:1" to the name.
  if (benchmark_threads > 1) registered->Threads(benchmark_threads);
}

}  // namespace

void RegisterSharedCase(const std::string& name,
                        const std::function<void(benchmark::State&)>& body) {
  for (const int threads : kThreadCounts) Register(name, threads, body);
}

void RegisterParallelCase(const std::string& name,
                          const std::function<void(benchmark::State&, int)>& body) {
  for (const int threads : kThreadCounts) {
    const std::string suffix = threads > 1 ? "/threads:" + std::to_string(threads) : "";
    Register(name + suffix, 1, [body, threads](benchmark::State& state) { body(state, threads); });
  }
}

}  // namespace semfoam
