// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/scene_loading.h"

#include "foam/memory_plan.h"
#include "tools/progress.h"

#include <algorithm>
#include <chrono>
#include <iostream>
#include <utility>

#include <unistd.h>

namespace semfoam {
namespace {

constexpr double kShareOfFreeMemory = 0.75;

}  // namespace

ImageMemory PlanImageMemory(double image_cache_gb,
                            const ScenePlan& plan,
                            const TrainingOptions& training,
                            bool draws_any_number,
                            int64_t available) {
  const bool has_semantics = plan.masks.NumPaired() > 0;
  const MemoryPlan rest = PlanMemory(
      training, has_semantics, static_cast<int64_t>(plan.seeds.size()), /*photo_bytes=*/0);
  ImageMemory memory;
  memory.cache_bytes =
      image_cache_gb >= 0
          ? static_cast<int64_t>(1e9 * image_cache_gb)
          : static_cast<int64_t>(kShareOfFreeMemory * static_cast<double>(std::max<int64_t>(
                                                          0, available - rest.Total())));
  const auto all = static_cast<int64_t>(plan.MemoryBytes());
  memory.holds_all = all <= memory.cache_bytes;
  if (memory.holds_all) {
    memory.bytes = all;
    return memory;
  }
  LoadOptions load;
  load.cache_bytes = memory.cache_bytes;
  const auto decoding = static_cast<int64_t>(plan.DecodingBytes());
  const int64_t drawn = DrawnPixelBytes(training);
  const bool reads_again = draws_any_number || drawn > memory.cache_bytes;
  // At first many photos are decoded at a time, before there are sites; later one is.
  const int64_t at_first = load.MostAtOnce(plan) * decoding - rest.OfSites();
  memory.bytes = (reads_again ? memory.cache_bytes : drawn) +
                 static_cast<int64_t>(plan.TableBytes()) +
                 std::max(reads_again ? decoding : 0, at_first);
  return memory;
}

TrainingScene LoadScene(ScenePlan plan, const ImageMemory& memory) {
  ProgressLine line(std::cerr, ::isatty(STDERR_FILENO) != 0);
  const auto begin = std::chrono::steady_clock::now();
  LoadOptions load;
  load.cache_bytes = memory.cache_bytes;
  load.report = [&](int done, int total) {
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    line.Show(FormatCount("checking photos", done, total, seconds.count()), seconds.count());
  };
  TrainingScene scene(std::move(plan), load);
  line.Clear();
  return scene;
}

std::string FormatCount(const std::string& what, int done, int total, double seconds) {
  std::string text = what + " " + std::to_string(done) + "/" + std::to_string(total);
  if (done > 0 && done < total) {
    text += ", " + FormatDuration(seconds * (total - done) / done) + " left";
  }
  return text;
}

}  // namespace semfoam
