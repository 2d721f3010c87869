// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/device/cpu_device.h"

#include "foam/model/classifier.h"
#include "foam/model/sh_degree.h"
#include "foam/render/cell_shading.h"
#include "foam/render/ray_tracer.h"
#include "foam/render/total_variation.h"
#include "foam/util/array_rows.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <span>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Neighbouring rays, traced together.
constexpr int64_t kRaysPerBlock = 256;

// What each of the rays shows, and how many of them hit the step limit. `Ray` has an origin, a
// direction and a start_cell.
template <typename Ray>
std::vector<RenderedRay> RenderRays(const WalkGeometry<float>& geometry,
                                    const CellShading<float>& shading,
                                    const ClassifierView<float>& classifier,
                                    std::span<const Ray> rays,
                                    int64_t* step_limit_hits) {
  const float cutoff_tau = static_cast<float>(-std::log(kTransmittanceCutoff));
  std::vector<RenderedRay> rendered(rays.size());
  std::atomic<int64_t> hits = 0;
  ParallelForBlocks(rays.size(), kRaysPerBlock, [&](int64_t begin, int64_t end) {
    const std::span<RayTrace> traces = ThreadTraces(end - begin);
    for (int64_t i = begin; i < end; ++i) {
      RayTrace& trace = traces[i - begin];
      trace.origin = rays[i].origin;
      trace.direction = rays[i].direction;
      trace.start_cell = rays[i].start_cell;
      trace.quantile_tau[0] = std::log(2.f);
    }
    TraceRays(geometry, shading, cutoff_tau, traces);
    std::vector<float> logits(classifier.num_classes);
    for (int64_t i = begin; i < end; ++i) {
      const RayTrace& trace = traces[i - begin];
      const RayComposite<float>& ray = trace.composite;
      hits += trace.hit_step_limit;
      RenderedRay& out = rendered[i];
      out.color =
          Eigen::Vector3f(ray.color[0], ray.color[1], ray.color[2]).array() + ray.Transmittance();
      out.opacity = ray.Opacity();
      if (ray.quantile_segment[0] >= 0) out.distance = ray.quantile_depth[0];
      if (classifier.num_classes == 0 || out.opacity < 0.5f) continue;
      ClassLogits(
          classifier.weight, classifier.bias, classifier.num_classes, ray.identity, logits.data());
      const MostLikelyClass best = ArgmaxSoftmax(logits);
      out.class_index = best.class_index;
      out.confidence = best.confidence;
    }
  });
  *step_limit_hits = hits;
  return rendered;
}

class CpuTrainingDevice final : public TrainingDevice {
 public:
  CpuTrainingDevice(TrainingState* state, RankGroup* ranks) : state_(*state), ranks_(ranks) {}

  DeviceKind Kind() const override { return DeviceKind::kCpu; }

  RankGroup* ranks() const override { return ranks_; }

  void Download() override {}

  void DownloadSites() override {}

  void Upload() override { density_ = CellDensities(state_.foam); }

  void Rearrange(const Rearrangement& plan) override {
    semfoam::Rearrange(plan, state_.densification, {}, &state_.foam);
    state_.optimizer->Rearrange(plan.origin, plan.is_new);
    Gather(plan.origin, 1, &state_.is_frozen);
    Gather(plan.origin, 1, &state_.ancestor);
    state_.ResetDensification();
  }

  void UploadTopology() override {}

  // One core triangulates about 0.2 M sites a second, and two cores, one of them busy with that,
  // take some 20 ms for an iteration.
  int TriangulationLag(size_t num_sites) const override {
    constexpr size_t kSitesPerIteration = 4096;
    return static_cast<int>(num_sites / kSitesPerIteration);
  }

  void ClampDensities() override {
    Foam& foam = state_.foam;
    const std::vector<uint8_t>& is_clear = state_.topology.is_clear();
    CHECK_EQ(is_clear.size(), foam.NumSites());
    ParallelForBlocks(foam.NumSites(), 1024, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        // What must be clear follows from neighbours, too, of which a block has but some.
        if (!state_.is_frozen.empty() && state_.is_frozen[i] != 0) continue;
        foam.raw_density[i] = ClampedRawDensity(foam.raw_density[i], is_clear[i] != 0);
      }
    });
    density_ = CellDensities(foam);
  }

  void RefreshPlanes() override { state_.topology.RefreshPlanes(state_.foam.positions); }

  void StartCells(const std::vector<Eigen::Vector3d>& origins,
                  std::vector<uint32_t>* cells) override {
    CHECK_EQ(origins.size(), cells->size());
    for (size_t i = 0; i < origins.size(); ++i) {
      (*cells)[i] = state_.topology.CellAt(origins[i], (*cells)[i]);
    }
  }

  TrainingStepResult Step(const TrainingStep& step) override {
    TrainingStepResult result;
    CastBatch(state_.topology.geometry(),
              Shading(),
              Classifier(),
              step.weights,
              step.cutoff_tau,
              step.rays,
              &batch_,
              ranks_);
    // Training takes the two variations in turns, so that one array serves both.
    const bool takes_colors = step.color_tv_weight > 0;
    if ((surface_colors_.capacity() > tv_gradient_.capacity()) != takes_colors) {
      surface_colors_.swap(tv_gradient_);
    }
    tv_gradient_.clear();
    ColorGraph color_graph;
    if (takes_colors) {
      const Delaunay& delaunay = state_.topology.delaunay();
      CHECK_EQ(state_.topology.tv_weights().size(), delaunay.neighbors.size());
      CollectSurfaceColors(state_.foam, density_, state_.topology.step_lengths(), &surface_colors_);
      color_graph = {delaunay.offsets.data(),
                     delaunay.neighbors.data(),
                     state_.topology.tv_weights().data(),
                     delaunay.num_sites,
                     surface_colors_.data(),
                     static_cast<float>(kIdentityDim * step.color_tv_weight)};
    }
    if (step.tv_weight > 0) {
      result.tv_loss = TotalVariation(state_.topology.delaunay(),
                                      state_.topology.tv_weights(),
                                      state_.foam.identity,
                                      static_cast<float>(step.tv_weight),
                                      &tv_gradient_);
    }
    result.skipped_updates = state_.optimizer->Step(&batch_,
                                                    tv_gradient_,
                                                    color_graph,
                                                    state_.topology.geometry().positions,
                                                    state_.topology.is_clear(),
                                                    state_.topology.step_lengths(),
                                                    step.rates,
                                                    &state_.foam,
                                                    &density_,
                                                    &state_.densification);
    result.batch = batch_.totals;
    return result;
  }

  std::vector<RenderedRay> Render(const std::vector<BatchRay>& rays, int sh_degree) override {
    CellShading<float> shading = Shading();
    LargePageVector<float> lower_sh;
    if (sh_degree < state_.foam.sh_degree) {
      lower_sh = ShOfDegree(state_.foam, sh_degree);
      shading.sh_degree = sh_degree;
      shading.sh = lower_sh.data();
    }
    // A topology that has become stale may cut a ray; training counts and judges these.
    int64_t step_limit_hits = 0;
    return RenderRays(state_.topology.geometry(),
                      shading,
                      Classifier(),
                      std::span<const BatchRay>(rays),
                      &step_limit_hits);
  }

 private:
  CellShading<float> Shading() const { return ShadingOf(state_.foam, density_); }
  ClassifierView<float> Classifier() const { return ClassifierOf(state_.foam); }

  TrainingState& state_;
  RankGroup* const ranks_;             // null: this process alone
  std::vector<float> density_;         // [num_cells] activated
  std::vector<float> tv_gradient_;     // [N][kIdentityDim]; empty in steps without the regulariser
  std::vector<float> surface_colors_;  // [N][kSurfaceColorDim] of the last step that took them
  BatchResult batch_;
};

class CpuRayCaster final : public RayCaster {
 public:
  CpuRayCaster(const WalkGeometry<float>& geometry,
               const CellShading<float>& shading,
               const ClassifierView<float>& classifier)
      : geometry_(geometry), shading_(shading), classifier_(classifier) {}

  std::vector<RenderedRay> Render(std::span<const RayQuery> rays) const override {
    int64_t step_limit_hits = 0;
    std::vector<RenderedRay> rendered =
        RenderRays(geometry_, shading_, classifier_, rays, &step_limit_hits);
    CHECK_EQ(step_limit_hits, 0) << "rays walked in circles";
    return rendered;
  }

 private:
  const WalkGeometry<float>& geometry_;
  const CellShading<float> shading_;
  const ClassifierView<float> classifier_;
};

}  // namespace

std::unique_ptr<TrainingDevice> MakeCpuTrainingDevice(TrainingState* state, RankGroup* ranks) {
  return std::make_unique<CpuTrainingDevice>(state, ranks);
}

std::unique_ptr<RayCaster> MakeCpuRayCaster(const WalkGeometry<float>& geometry,
                                            const CellShading<float>& shading,
                                            const ClassifierView<float>& classifier) {
  return std::make_unique<CpuRayCaster>(geometry, shading, classifier);
}

}  // namespace semfoam
