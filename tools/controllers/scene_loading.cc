// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/scene_loading.h"

#include "foam/train/memory_plan.h"
#include "foam/util/parallel.h"
#include "plugin/dataset/scene_memory.h"
#include "tools/support/memory_task.h"
#include "tools/support/progress.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace semfoam {
namespace {

constexpr double kShareOfFreeMemory = 0.75;

// Returns how many threads may decode at a time, each in `bytes` of `room`.
int MostAtOnce(int64_t room, int64_t bytes) {
  return static_cast<int>(std::clamp<int64_t>(room / std::max<int64_t>(1, bytes), 1, NumThreads()));
}

}  // namespace

ImageMemory PlanImageMemory(double image_cache_gb,
                            const ScenePlan& plan,
                            const TrainingOptions& training,
                            const SweepMemory& sweep,
                            bool draws_any_number,
                            int64_t available) {
  const int num_classes = plan.masks.NumPaired() > 0 ? kUsualClasses : 0;
  const MemoryPlan rest =
      PlanMemory(training, num_classes, static_cast<int64_t>(plan.seeds.size()), /*photo_bytes=*/0);
  ImageMemory memory;
  memory.cache_bytes = image_cache_gb >= 0
                           ? static_cast<int64_t>(1e9 * image_cache_gb)
                           : static_cast<int64_t>(kShareOfFreeMemory *
                                                  static_cast<double>(std::max<int64_t>(
                                                      0, available - rest.Total() - sweep.kept)));
  for (size_t i = 0; i < plan.files.size(); ++i) {
    RequireDecodingMemory(plan.files[i], plan.file_sizes[i], plan.photo_decoding[i], available);
  }
  const SceneMemory scene = MemoryOf(plan);
  const auto all = static_cast<int64_t>(scene.held);
  memory.holds_all = all <= memory.cache_bytes;
  // There is no foam yet when photos are decoded, so that up to its size, more of them at a time
  // make no higher peak.
  const int64_t of_foam = rest.OfSites() + rest.batch;
  const auto correcting = static_cast<int64_t>(scene.correction);
  if (memory.holds_all) {
    const auto loading = static_cast<int64_t>(scene.loading);
    memory.most_at_once = MostAtOnce(std::max(memory.cache_bytes - all, of_foam), loading);
    memory.bytes =
        all + sweep.kept +
        std::max<int64_t>(
            0, std::max({memory.most_at_once * loading, correcting, sweep.peak}) - of_foam);
    return memory;
  }
  const auto opening = static_cast<int64_t>(scene.opening);
  memory.most_at_once = MostAtOnce(memory.cache_bytes, opening);
  const int64_t drawn = DrawnPixelBytes(training);
  const bool reads_again = draws_any_number || drawn > memory.cache_bytes;
  // While many are decoded at a time, training waits, and so do triangulations.
  const int64_t at_once = memory.most_at_once * opening - rest.triangulation;
  const int64_t sweeping = sweep.peak > 0 ? sweep.peak + memory.most_at_once * opening : 0;
  memory.bytes = (reads_again ? memory.cache_bytes : drawn) + static_cast<int64_t>(scene.always) +
                 sweep.kept +
                 std::max({int64_t{0},
                           reads_again ? opening : 0,
                           at_once,
                           correcting - of_foam,
                           sweeping - of_foam});
  return memory;
}

TrainingScene LoadScene(ScenePlan plan,
                        const ImageMemory& memory,
                        const SceneFindings* known,
                        bool keeps_findings) {
  const MemoryTask task("photos and masks are decoded",
                        "a smaller image_cache_gb, max_image_size or num_threads");
  ProgressLine line;
  const auto begin = std::chrono::steady_clock::now();
  LoadOptions load;
  load.cache_bytes = memory.cache_bytes;
  load.most_at_once = memory.most_at_once;
  load.known = known;
  load.keeps_findings = keeps_findings;
  load.report = [&](int done, int total) {
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    line.Show(CountProgress("checking photos", done, total, seconds.count()));
  };
  TrainingScene scene(std::move(plan), load);
  line.Clear();
  return scene;
}

}  // namespace semfoam
