// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/render/walk.h"
#include "tools/benchmark/bytes.h"
#include "tools/benchmark/case.h"
#include "tools/benchmark/cases.h"
#include "tools/benchmark/scenes.h"

#include <span>
#include <string>
#include <vector>

namespace semfoam {
namespace {

// Walks all rays to the end of the foam and returns the number of steps, or -1 if the step limit
// cut one.
using Walker = int64_t (*)(const WalkGeometry<float>& geometry, std::span<const WalkQuery> rays);

int64_t WalkScalar(const WalkGeometry<float>& geometry, std::span<const WalkQuery> rays) {
  int64_t steps = 0;
  float exits = 0;
  for (const WalkQuery& ray : rays) {
    const bool ended = Walk(geometry,
                            ray.origin,
                            ray.direction,
                            ray.start_cell,
                            [&](uint32_t, float, float t_out, uint32_t, bool) {
                              ++steps;
                              exits += t_out;
                              return true;
                            });
    if (!ended) return -1;
  }
  benchmark::DoNotOptimize(exits);
  return steps;
}

template <int kInFlight>
int64_t WalkVectors(const WalkGeometry<float>& geometry, std::span<const WalkQuery> rays) {
  thread_local std::vector<WalkResult> results;
  results.resize(rays.size());
  WalkRays(geometry, rays, kInFlight, results);
  int64_t steps = 0;
  for (const WalkResult& result : results) steps += result.steps;
  return steps;
}

struct Variant {
  const char* name;
  Walker walk;
};
constexpr Variant kVariants[] = {{"walk/scalar", WalkScalar},
                                 {"walk/simd", WalkVectors<1>},
                                 {"walk/interleaved", WalkVectors<kRaysInFlight>}};

// Returns the mean over the steps of every 16th ray.
double MeanStepBytes(const BenchmarkScene& scene) {
  const WalkGeometry<float>& geometry = scene.renderer.geometry();
  double bytes = 0, steps = 0;
  for (size_t i = 0; i < scene.rays.size(); i += 16) {
    const WalkQuery& ray = scene.rays[i];
    Walk(geometry,
         ray.origin,
         ray.direction,
         ray.start_cell,
         [&](uint32_t cell, float, float, uint32_t, bool) {
           bytes += StepBytes(geometry, cell);
           ++steps;
           return true;
         });
  }
  return bytes / steps;
}

void RunWalk(benchmark::State& state, int64_t num_sites, Walker walk) {
  const auto scene = ShellScene(num_sites);
  const WalkGeometry<float>& geometry = scene->renderer.geometry();
  const double step_bytes = MeanStepBytes(*scene);
  const std::span<const WalkQuery> all_rays(scene->rays);
  Stopwatch watch;
  int64_t steps = 0, rays = 0;
  for ([[maybe_unused]] auto iteration : state) {
    const Stopwatch::Lap lap(&watch);
    ForOwnShare(state, all_rays.size(), [&](int64_t begin, int64_t end) {
      const int64_t more = walk(geometry, all_rays.subspan(begin, end - begin));
      if (more < 0) state.SkipWithError("the step limit cut a walk");
      steps += more;
      rays += end - begin;
    });
  }
  state.counters["steps_per_second"] = Rate(steps, watch);
  state.counters["rays_per_second"] = Rate(rays, watch);
  state.counters["bytes_per_site"] = Same(double(WalkBytes(geometry)) / num_sites);
  state.counters["touched_per_step"] = Same(step_bytes);
}

}  // namespace

// The walk alone: every ray of the picture from the camera to the end of the foam.
void RegisterWalkCases(int64_t num_sites) {
  for (const Variant& variant : kVariants) {
    RegisterSharedCase(variant.name + ("/" + std::to_string(num_sites)),
                       [num_sites, walk = variant.walk](benchmark::State& state) {
                         RunWalk(state, num_sites, walk);
                       });
  }
}

}  // namespace semfoam
