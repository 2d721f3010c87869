// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/render/cell_shading.h"
#include "foam/render/ray_batch.h"
#include "foam/render/ray_tracer.h"
#include "foam/util/parallel.h"
#include "foam/view/view_renderer.h"
#include "tools/benchmark/bytes.h"
#include "tools/benchmark/case.h"
#include "tools/benchmark/cases.h"
#include "tools/benchmark/scenes.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace semfoam {
namespace {

using SceneSource = std::function<std::shared_ptr<const BenchmarkScene>()>;

float CutoffTau() { return static_cast<float>(-std::log(kTransmittanceCutoff)); }

// What a forward render of some rays came to.
struct RenderTotals {
  int64_t rays = 0;
  int64_t segments = 0;
  bool hit_step_limit = false;
};

// Colour, identity and the depths at which the transmittance falls through 3/4 and 1/4. Calls
// look(const RayTrace&) for each ray.
template <typename Look>
void RenderRays(const BenchmarkScene& scene,
                std::span<const WalkQuery> rays,
                Look&& look,
                RenderTotals* totals) {
  constexpr size_t kRaysPerCall = 256;  // as ViewRenderer has it
  for (size_t begin = 0; begin < rays.size(); begin += kRaysPerCall) {
    const size_t count = std::min(kRaysPerCall, rays.size() - begin);
    const std::span<RayTrace> traces = ThreadTraces(count);
    for (size_t k = 0; k < count; ++k) {
      traces[k].origin = rays[begin + k].origin;
      traces[k].direction = rays[begin + k].direction;
      traces[k].start_cell = rays[begin + k].start_cell;
      traces[k].quantile_tau[0] = -std::log(0.75f);
      traces[k].quantile_tau[1] = -std::log(0.25f);
    }
    TraceRays(scene.renderer.geometry(), scene.renderer.shading(), CutoffTau(), traces);
    for (RayTrace& trace : traces) {
      totals->segments += trace.num_segments;
      totals->hit_step_limit |= trace.hit_step_limit;
      look(trace);
    }
  }
  totals->rays += rays.size();
}

// What a foam holds for each site that is to be rendered.
double RenderBytesPerSite(const BenchmarkScene& scene) {
  const Foam& foam = scene.foam;
  return double(WalkBytes(scene.renderer.geometry())) / foam.NumSites() + sizeof(float) +
         AppearanceBytes(foam);
}

// What a ray reads, mean over every 16th: its steps, the density of each cell, and colour and
// identity where they count (the mean colour alone where they do not).
double MeanRayBytes(const BenchmarkScene& scene) {
  std::vector<WalkQuery> rays;
  for (size_t i = 0; i < scene.rays.size(); i += 16) rays.push_back(scene.rays[i]);
  double bytes = 0;
  RenderTotals totals;
  const auto count = [&](const RayTrace& trace) {
    for (int k = 0; k < trace.num_segments; ++k) {
      bytes += StepBytes(scene.renderer.geometry(), trace.segments[k].cell) + sizeof(float);
      if (trace.sites[k].density == 0) continue;
      bytes +=
          trace.weight[k] > kNegligibleWeight ? AppearanceBytes(scene.foam) : 3 * sizeof(float);
    }
  };
  RenderRays(scene, rays, count, &totals);
  return bytes / totals.rays;
}

// Rays of the picture to where they are opaque: walk, weights, colour, identity, depth quantiles.
void RunForward(benchmark::State& state, const SceneSource& source) {
  const auto scene = source();
  const double ray_bytes = MeanRayBytes(*scene);
  const std::span<const WalkQuery> all_rays(scene->rays);
  const auto keep = [](RayTrace& trace) { benchmark::DoNotOptimize(trace.composite); };
  RenderTotals totals;
  Stopwatch watch;
  for ([[maybe_unused]] auto iteration : state) {
    const Stopwatch::Lap lap(&watch);
    ForOwnShare(state, all_rays.size(), [&](int64_t begin, int64_t end) {
      RenderRays(*scene, all_rays.subspan(begin, end - begin), keep, &totals);
    });
  }
  if (totals.hit_step_limit) state.SkipWithError("the step limit cut a ray");
  state.counters["rays_per_second"] = Rate(totals.rays, watch);
  state.counters["steps_per_second"] = Rate(totals.segments, watch);
  state.counters["bytes_per_site"] = Same(RenderBytesPerSite(*scene));
  state.counters["touched_per_ray"] = Same(ray_bytes);
}

// What training does for each ray, batch after batch: forward, loss, backward, and the records
// for the cells written down, but not yet summed (that is `update`).
void RunBackward(benchmark::State& state, const SceneSource& source, int num_threads) {
  const auto scene = source();
  const Foam& foam = scene->foam;
  const double forward_bytes = MeanRayBytes(*scene);
  const ThreadLimit limit(num_threads);
  BatchResult result;
  int64_t rays = 0, segments = 0, records = 0, step_limit_hits = 0;
  size_t next = 0;
  const auto cast = [&]() -> const std::vector<BatchRay>& {
    const std::vector<BatchRay>& batch = scene->batches[next++ % scene->batches.size()];
    CastBatch(scene->renderer.geometry(),
              scene->renderer.shading(),
              ClassifierOf(foam),
              RayLossWeights{},
              CutoffTau(),
              batch,
              &result);
    return batch;
  };
  // A run keeps its buffers: the first batches, for which they grow, are not what it is like.
  for (int i = 0; i < 4; ++i) cast();
  Stopwatch watch;
  for ([[maybe_unused]] auto iteration : state) {
    const Stopwatch::Lap lap(&watch);
    const std::vector<BatchRay>& batch = cast();
    rays += batch.size();
    segments += result.totals.num_segments;
    step_limit_hits += result.totals.step_limit_hits;
    for (const auto& block : result.gradients.blocks()) records += block.size();
  }
  if (step_limit_hits > 0) state.SkipWithError("the step limit cut a ray");
  state.counters["rays_per_second"] = Rate(rays, watch);
  state.counters["steps_per_second"] = Rate(segments, watch);
  state.counters["bytes_per_site"] = Same(RenderBytesPerSite(*scene));
  state.counters["touched_per_ray"] =
      Same(forward_bytes + double(records) / rays * sizeof(GradientRecord));
}

using SceneOf = std::function<std::shared_ptr<const BenchmarkScene>(Appearance)>;

void RegisterOn(const std::string& scene_name, const SceneOf& scene_of) {
  const SceneSource full = [scene_of] { return scene_of(Appearance::kFull); };
  const SceneSource plain = [scene_of] { return scene_of(Appearance::kPlain); };
  RegisterSharedCase("render/forward/" + scene_name,
                     [full](benchmark::State& state) { RunForward(state, full); });
  RegisterParallelCase(
      "render/backward/" + scene_name,
      [full](benchmark::State& state, int num_threads) { RunBackward(state, full, num_threads); });
  // Beside it, what is left of that when a scene calls for no effect.
  RegisterParallelCase("render/backward_plain/" + scene_name,
                       [plain](benchmark::State& state, int num_threads) {
                         RunBackward(state, plain, num_threads);
                       });
}

}  // namespace

void RegisterRenderCases(int64_t num_sites) {
  RegisterOn(std::to_string(num_sites),
             [num_sites](Appearance appearance) { return ShellScene(num_sites, appearance); });
}

void RegisterRenderCases(const std::filesystem::path& foam_file) {
  RegisterOn("foam",
             [foam_file](Appearance appearance) { return TrainedScene(foam_file, appearance); });
}

}  // namespace semfoam
