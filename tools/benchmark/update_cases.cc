// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/optim/optimizer.h"
#include "foam/render/cell_shading.h"
#include "foam/render/ray_batch.h"
#include "foam/render/total_variation.h"
#include "foam/render/walk.h"
#include "foam/util/parallel.h"
#include "foam/view/view_renderer.h"
#include "tools/benchmark/bytes.h"
#include "tools/benchmark/case.h"
#include "tools/benchmark/cases.h"
#include "tools/benchmark/scenes.h"

#include <array>
#include <cmath>
#include <string>

namespace semfoam {
namespace {

// The variations join, and the planes follow, every so many updates, as in training.
constexpr int kRoundUpdates = 4;

// The radius of all cells, by which the variation of the colours takes nearly all for opaque.
constexpr float kRadius = 0.05f;

// All that an update reads and writes, its foam included. Sites learn at rate 0: they stay where
// their topology holds, and the work is the same.
class Updater {
 public:
  explicit Updater(const BenchmarkScene& scene)
      : delaunay_(scene.renderer.delaunay()),
        foam_(scene.foam),
        optimizer_(foam_),
        is_clear_(foam_.NumSites(), 0),
        step_lengths_(foam_.NumSites(), {kRadius, 1}) {
    SetTopology(delaunay_, &geometry_);
    density_ = CellDensities(foam_);
    const std::vector<Eigen::Vector3f> cells = WithGuardSites(foam_.positions);
    Refresh(cells, &geometry_);
    tv_weights_ = TotalVariationWeights(
        delaunay_, FaceAreas(cells, delaunay_, VoronoiVertices(cells, delaunay_)));
    statistics_.Reset(foam_.NumSites());
    for (int k = 0; k < kRoundUpdates; ++k) {
      CastBatch(scene.renderer.geometry(),
                scene.renderer.shading(),
                ClassifierOf(foam_),
                RayLossWeights{},
                static_cast<float>(-std::log(kTransmittanceCutoff)),
                scene.batches[k],
                &batches_[k]);
    }
  }
  Updater(const Updater&) = delete;

  // What follows the casting of a batch, kRoundUpdates times: records grouped by cell, Adam; with
  // the regulariser's gradient in the first and the planes after the last. Returns the number of
  // gradients that were not finite.
  int64_t Round() {
    int64_t not_finite = 0;
    TotalVariation(delaunay_, tv_weights_, foam_.identity, float{kRoundUpdates}, &tv_gradient_);
    CollectSurfaceColors(foam_, density_, step_lengths_, &surface_colors_);
    ColorGraph color_graph = {delaunay_.offsets.data(),
                              delaunay_.neighbors.data(),
                              tv_weights_.data(),
                              delaunay_.num_sites,
                              surface_colors_.data(),
                              float{kRoundUpdates}};
    for (BatchResult& batch : batches_) {
      not_finite += optimizer_.Step(&batch,
                                    tv_gradient_,
                                    color_graph,
                                    geometry_.positions,
                                    is_clear_,
                                    step_lengths_,
                                    LearningRates{},
                                    &foam_,
                                    &density_,
                                    &statistics_);
      tv_gradient_.clear();
      color_graph = {};
    }
    Refresh(WithGuardSites(foam_.positions), &geometry_);
    return not_finite;
  }

  // What an update keeps: parameters with two moments, statistics, the regulariser and what follows
  // from the sites. After a Round.
  double BytesPerSite() const {
    return (3.0 * ParameterBytes() * foam_.NumSites() + BytesOf(statistics_.squared_error) +
            BytesOf(statistics_.contribution) + BytesOf(tv_weights_) + TvGradientBytes() +
            BytesOf(surface_colors_) + BytesOf(density_) + WalkBytes(geometry_)) /
           foam_.NumSites();
  }

  // What an update has to touch, mean of a Round. After a Round.
  double BytesPerUpdate() const {
    const double sites = foam_.NumSites();
    double records = 0, cells = 0, rays = 0;
    for (const BatchResult& batch : batches_) {
      records += double(batch.gradients.NumRecords()) / kRoundUpdates;
      rays += double(batch.rays.size()) / kRoundUpdates;
      GradientSum::Bucket bucket;
      for (uint32_t b = 0; b < batch.gradients.NumBuckets(); ++b) {
        batch.gradients.Group(b, &bucket);
        for (uint32_t cell = bucket.first_cell(); cell < bucket.last_cell(); ++cell) {
          cells += double(!bucket.Of(cell).empty()) / kRoundUpdates;
        }
      }
    }
    // Each record is read to be counted, read and written by one pass, then read from its bucket.
    const double group = 4 * records * sizeof(GradientRecord);
    // Parameters and their moments are read and written; so is the density that follows.
    const double adam = (6 * ParameterBytes() + sizeof(float)) * cells + rays * sizeof(RayOutput);
    // Weights and neighbours in, twice, identities in, the gradient and the colours out and in
    // again; then Adam on every cell's identity.
    const double tv = 2 * (BytesOf(tv_weights_) + BytesOf(delaunay_.neighbors)) +
                      BytesOf(foam_.identity) + 2 * BytesOf(surface_colors_) +
                      2 * TvGradientBytes() + 6 * sizeof(float) * kIdentityDim * (sites - cells);
    // Sites in, planes out.
    const double follow = BytesOf(foam_.positions) + WalkBytes(geometry_);
    return group + adam + (tv + follow) / kRoundUpdates;
  }

 private:
  // Of one site: position, density, appearance.
  double ParameterBytes() const { return 4 * sizeof(float) + AppearanceBytes(foam_); }
  double TvGradientBytes() const { return sizeof(float) * kIdentityDim * foam_.NumSites(); }

  const Delaunay& delaunay_;
  Foam foam_;
  FoamOptimizer optimizer_;
  const std::vector<uint8_t> is_clear_;
  const std::vector<StepLengths> step_lengths_;
  std::vector<float> tv_weights_;
  std::vector<float> tv_gradient_;
  std::vector<float> surface_colors_;
  DensificationStatistics statistics_;
  std::array<BatchResult, kRoundUpdates> batches_;
  WalkGeometry<float> geometry_;
  std::vector<float> density_;
};

}  // namespace

// What training does between the casting of one batch of 4096 rays and the next.
void RegisterUpdateCases(int64_t num_sites) {
  RegisterParallelCase(
      "update/" + std::to_string(num_sites), [num_sites](benchmark::State& state, int num_threads) {
        const auto scene = ShellScene(num_sites);
        Updater updater(*scene);
        // Moments, planes and scratch get their memory.
        bool finite = updater.Round() == 0;
        const ThreadLimit limit(num_threads);
        Stopwatch watch;
        int64_t updates = 0;
        for ([[maybe_unused]] auto iteration : state) {
          const Stopwatch::Lap lap(&watch);
          finite &= updater.Round() == 0;
          updates += kRoundUpdates;
        }
        if (!finite) state.SkipWithError("a gradient is not finite");
        state.counters["updates_per_second"] = Rate(updates, watch);
        state.counters["sites_per_second"] = Rate(double(updates) * num_sites, watch);
        state.counters["rays_per_second"] = Rate(double(updates) * kBatchRays, watch);
        state.counters["bytes_per_site"] = Same(updater.BytesPerSite());
        state.counters["touched_per_update"] = Same(updater.BytesPerUpdate());
      });
}

}  // namespace semfoam
