// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/cuda/batch_kernels.h"
#include "foam/device/cuda/gpu_batch.h"
#include "foam/device/cuda/gpu_scene.h"
#include "foam/device/cuda/gpu_sites.h"
#include "foam/device/cuda/render_kernels.h"
#include "foam/device/cuda/update_kernels.h"
#include "foam/optim/training_device.h"
#include "foam/render/cell_shading.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {

// Computes the iterations of a training on a GPU (Machine: CudaMachine; HostMachine in tests). The
// state is in the GPU's memory; an iteration sends rays to it (GpuBatch), updates all cells, and
// fetches sums.
template <typename Machine>
class GpuTraining : public TrainingDevice {
 public:
  template <typename... Arguments>
  explicit GpuTraining(TrainingState* state, Arguments&&... arguments)
      : state_(state), machine_(std::forward<Arguments>(arguments)...) {
    const std::vector<AdamCorrection>& corrections = AdamCorrections();
    Send(corrections, &corrections_);
    any_twin_.Resize(1);
  }

  DeviceKind Kind() const override { return DeviceKind::kGpu; }

  void Upload() override {
    const Foam& foam = state_->foam;
    num_sites_ = static_cast<uint32_t>(foam.NumSites());
    sites_.Upload(machine_, state_);
    Send(foam.sh, &scene_.sh);
    Send(foam.color_gradient, &scene_.color_gradient);
    Send(foam.identity, &scene_.identity);
    scene_.Send(machine_, ClassifierOf(foam));
    ActivateDensities();
  }

  void Rearrange(const Rearrangement& plan) override {
    sites_.Rearrange(machine_, plan, &scene_);
    num_sites_ = static_cast<uint32_t>(plan.origin.size());
    state_->foam.positions.resize(num_sites_);
  }

  void UploadTopology() override {
    const TrainingTopology& topology = state_->topology;
    CHECK_EQ(topology.geometry().num_sites, num_sites_);
    scene_.Send(machine_, topology.geometry());
    Send(topology.is_clear(), &is_clear_);
    Send(topology.step_lengths(), &step_lengths_);
    has_graph_ = !topology.tv_weights().empty();
    if (!has_graph_) return;
    const Delaunay& delaunay = topology.delaunay();
    Send(delaunay.offsets, &offsets_);
    Send(delaunay.neighbors, &neighbors_);
    Send(topology.tv_weights(), &tv_weights_);
  }

  void ClampDensities() override {
    CHECK_EQ(is_clear_.size(), num_sites_);
    machine_.ForEach(num_sites_, ClampDensity{is_clear_.data(), sites_.raw_density.data()});
    ActivateDensities();
  }

  void DownloadSites() override { sites_.DownloadSites(machine_, state_); }

  void Download() override {
    DownloadSites();
    sites_.DownloadLearned(machine_, state_);
    Fetch(scene_.sh, &state_->foam.sh);
    Fetch(scene_.color_gradient, &state_->foam.color_gradient);
    Fetch(scene_.identity, &state_->foam.identity);
    std::vector<Eigen::Vector3f> planes(num_sites_);
    machine_.Download(scene_.positions, num_sites_, planes.data());
    const auto& host_planes = state_->topology.geometry().positions;
    if (!std::equal(planes.begin(), planes.end(), host_planes.begin())) {
      state_->topology.RefreshPlanes(planes);
    }
  }

  // CGAL triangulates about 0.2 M sites a second; iterations of that many sites do not wait for it
  // if they take 40 ms or more. An estimate: no GPU has run this yet.
  int TriangulationLag(size_t num_sites) const override {
    return std::max(8, static_cast<int>(num_sites / 8192));
  }

  void RefreshPlanes() override {
    machine_.ForEach(num_sites_, CopySite{sites_.positions.data(), scene_.positions.data()});
    scene_.has_twin.Resize(scene_.positions.size());
    machine_.Clear(&scene_.has_twin);
    machine_.Clear(&any_twin_);
    machine_.ForEach(int64_t{kPlaneLanes} * scene_.blocks.size(),
                     RefreshPlane{scene_.positions.data(),
                                  scene_.cell_of_block.data(),
                                  scene_.blocks.data(),
                                  scene_.has_twin.data(),
                                  any_twin_.data()});
    machine_.ForEach(scene_.blocks.size(),
                     LeaveNearDuplicatesToDouble{scene_.first_block.data(),
                                                 scene_.cell_of_block.data(),
                                                 scene_.has_twin.data(),
                                                 any_twin_.data(),
                                                 scene_.blocks.data()});
  }

  void StartCells(const std::vector<Eigen::Vector3d>& origins,
                  std::vector<uint32_t>* cells) override {
    CHECK_EQ(origins.size(), cells->size());
    const uint32_t num_cells = static_cast<uint32_t>(scene_.positions.size());
    for (uint32_t& cell : *cells) cell = std::min(cell, num_cells - 1);
    Send(origins, &origins_);
    Send(*cells, &start_cells_);
    machine_.ForEach(
        origins.size(),
        FindStartCell{scene_.Geometry(num_sites_), origins_.data(), start_cells_.data()});
    Fetch(start_cells_, cells);
  }

  TrainingStepResult Step(const TrainingStep& step) override {
    TrainingStepResult result;
    batch_.Cast(machine_,
                step,
                scene_.Geometry(num_sites_),
                scene_.Shading(state_->foam.sh_degree),
                scene_.Classes(NumClasses()),
                Row());
    int64_t num_contributions = 0;
    result.batch = batch_.FetchTotals(machine_, &num_contributions);
    batch_.SortContributions(machine_, num_sites_, num_contributions);
    const VariationGraph graph = Graph(step.tv_weight);
    if (graph.offsets != nullptr) result.tv_loss = TotalVariation(graph);
    result.skipped_updates =
        UpdateSites(step.rates, graph, CollectSurfaceColors(step.color_tv_weight));
    if (state_->foam.HasSemantics()) result.skipped_updates += UpdateClassifier(step);
    return result;
  }

  std::vector<RenderedRay> Render(const std::vector<BatchRay>& rays, int sh_degree) override {
    const int own_degree = state_->foam.sh_degree;
    CHECK_LE(sh_degree, own_degree);
    CellShading<float> shading = scene_.Shading(own_degree);
    if (sh_degree < own_degree) {
      shading.sh_degree = sh_degree;
      const int stride = 3 * NumShCoefficients(sh_degree);
      lower_sh_.Resize(size_t{num_sites_} * stride);
      machine_.ForEach(
          lower_sh_.size(),
          TakeLowerSh{
              scene_.sh.data(), 3 * NumShCoefficients(own_degree), stride, lower_sh_.data()});
      shading.sh = lower_sh_.data();
    }
    // A topology that has become stale may cut a ray; training counts and judges these.
    bool hit_step_limit = false;
    return renderer_.Render(machine_,
                            scene_.Geometry(num_sites_),
                            shading,
                            scene_.Classes(NumClasses()),
                            rays,
                            &hit_step_limit);
  }

 private:
  template <typename T>
  using Array = typename Machine::template Array<T>;

  template <typename Vector, typename T>
  void Send(const Vector& values, Array<T>* array) {
    SendTo(machine_, values, array);
  }
  template <typename T, typename Vector>
  void Fetch(const Array<T>& array, Vector* values) {
    FetchFrom(machine_, array, values);
  }

  int NumClasses() const { return state_->foam.num_classes; }
  const ParameterRow& Row() const { return state_->optimizer->row(); }

  void ActivateDensities() {
    scene_.density.Resize(size_t{num_sites_} + kNumGuardSites);
    machine_.Clear(&scene_.density);  // the guards'
    machine_.ForEach(num_sites_, ActivateDensity{sites_.raw_density.data(), scene_.density.data()});
  }

  VariationGraph Graph(double weight) const {
    if (weight == 0 || !has_graph_) return {};
    return {offsets_.data(), neighbors_.data(), tv_weights_.data(), static_cast<float>(weight)};
  }

  double TotalVariation(const VariationGraph& graph) {
    variation_.Resize(num_sites_);
    machine_.ForEach(
        num_sites_, MeasureVariation{graph, num_sites_, scene_.identity.data(), variation_.data()});
    return Sum(variation_) / 2;  // every edge was met from both sides
  }

  ColorGraph CollectSurfaceColors(double weight) {
    if (weight == 0) return {};
    CHECK(has_graph_);
    surface_colors_.Resize(size_t{num_sites_} * kSurfaceColorDim);
    machine_.ForEach(
        num_sites_,
        CollectSurfaceColor{sites_.positions.data(),
                            scene_.density.data(),
                            step_lengths_.data(),
                            scene_.sh.data(),
                            state_->foam.ShStride(),
                            Row().HasColorGradient() ? scene_.color_gradient.data() : nullptr,
                            surface_colors_.data()});
    return {offsets_.data(),
            neighbors_.data(),
            tv_weights_.data(),
            num_sites_,
            surface_colors_.data(),
            static_cast<float>(kIdentityDim * weight)};
  }

  template <typename T>
  double Sum(const Array<T>& values) {
    sums_.Resize((values.size() + kValuesPerSum - 1) / kValuesPerSum);
    machine_.ForEach(sums_.size(),
                     SumValues<T>{values.data(), int64_t(values.size()), sums_.data()});
    std::vector<double> sums;
    Fetch(sums_, &sums);
    return std::accumulate(sums.begin(), sums.end(), 0.0);
  }

  // Returns the number of cells whose gradient was not finite.
  int64_t UpdateSites(const LearningRates& rates,
                      const VariationGraph& graph,
                      const ColorGraph& color_graph) {
    const ParameterRow row = Row();
    const CellContributions contributions = batch_.Contributions();
    const bool has_variation = graph.offsets != nullptr;
    float* const color_gradient = row.HasColorGradient() ? scene_.color_gradient.data() : nullptr;
    gradients_.Resize(size_t{num_sites_} * row.size);
    not_finite_.Resize(num_sites_);
    squared_error_.Resize(num_sites_);
    contribution_.Resize(num_sites_);
    machine_.Clear(&not_finite_);
    const int64_t num_row_threads = int64_t{num_sites_} * kRowThreads;
    machine_.ForEach(num_row_threads,
                     SumCellGradient{contributions,
                                     {scene_.positions.data(), color_gradient},
                                     row,
                                     graph,
                                     color_graph,
                                     num_sites_,
                                     sites_.raw_density.data(),
                                     state_->foam.HasSemantics() ? scene_.identity.data() : nullptr,
                                     gradients_.data(),
                                     not_finite_.data(),
                                     squared_error_.data(),
                                     contribution_.data()});
    machine_.ForEach(num_row_threads,
                     AdamStepOfCell{row,
                                    {rates.identity,
                                     rates.position,
                                     rates.density,
                                     rates.color_gradient,
                                     rates.sh_dc,
                                     rates.sh_rest},
                                    state_->foam.ShStride(),
                                    has_variation,
                                    contributions.begin,
                                    contributions.end,
                                    not_finite_.data(),
                                    contribution_.data(),
                                    corrections_.data(),
                                    static_cast<uint32_t>(corrections_.size()),
                                    sites_.steps.data(),
                                    gradients_.data(),
                                    sites_.first_moments.data(),
                                    sites_.second_moments.data(),
                                    scene_.sh.data(),
                                    scene_.identity.data()});
    machine_.ForEach(num_sites_,
                     FinishCell{row,
                                has_variation,
                                contributions.begin,
                                contributions.end,
                                not_finite_.data(),
                                gradients_.data(),
                                step_lengths_.data(),
                                is_clear_.data(),
                                squared_error_.data(),
                                contribution_.data(),
                                sites_.steps.data(),
                                sites_.positions.data(),
                                sites_.raw_density.data(),
                                scene_.density.data(),
                                color_gradient,
                                sites_.squared_error.data(),
                                sites_.contribution.data()});
    return std::llround(Sum(not_finite_));
  }

  // Updates the classifier, which is small: its gradient is summed on the GPU, and the host takes
  // its step.
  int64_t UpdateClassifier(const TrainingStep& step) {
    Foam& foam = state_->foam;
    const int64_t num_samples = batch_.samples().size();
    const int64_t num_parameters = int64_t{foam.num_classes} * kClassRow;
    // As many parts as give about 2^16 threads, but with at least 256 samples each.
    const int64_t wanted = std::max<int64_t>(1, (1 << 16) / foam.num_classes);
    const int64_t per_part = std::max<int64_t>(256, (num_samples + wanted - 1) / wanted);
    const int64_t num_parts = (num_samples + per_part - 1) / per_part;
    class_sums_.Resize(num_parts * num_parameters);
    class_gradient_.Resize(num_parameters);
    machine_.ForEach(num_parts * foam.num_classes,
                     SumClassGradients{scene_.Classes(foam.num_classes),
                                       batch_.samples().data(),
                                       num_samples,
                                       per_part,
                                       class_sums_.data()});
    machine_.ForEach(
        num_parameters,
        AddClassParts{class_sums_.data(), num_parts, num_parameters, class_gradient_.data()});
    std::vector<float> gradient;
    Fetch(class_gradient_, &gradient);
    std::vector<float> by_weight, by_bias;
    for (int k = 0; k < foam.num_classes; ++k) {
      const auto row = gradient.begin() + int64_t{k} * kClassRow;
      by_weight.insert(by_weight.end(), row, row + kIdentityDim);
      by_bias.push_back(row[kIdentityDim]);
    }
    const int64_t skipped =
        state_->optimizer->StepClassifier(by_weight, by_bias, step.rates.classifier, &foam);
    scene_.Send(machine_, ClassifierOf(foam));
    return skipped;
  }

  TrainingState* const state_;
  Machine machine_;
  uint32_t num_sites_ = 0;

  // The foam and its topology; positions in the scene are those of the planes.
  GpuScene<Machine> scene_;
  GpuSites<Machine> sites_;
  Array<uint8_t> is_clear_;
  Array<StepLengths> step_lengths_;
  bool has_graph_ = false;
  Array<uint32_t> offsets_, neighbors_;
  Array<float> tv_weights_;
  Array<uint8_t> any_twin_;

  Array<AdamCorrection> corrections_;

  GpuBatch<Machine> batch_;

  // Scratch of an update.
  Array<float> gradients_;
  Array<uint8_t> not_finite_;
  Array<float> squared_error_, contribution_;
  Array<float> class_sums_, class_gradient_;
  Array<float> variation_;
  Array<float> surface_colors_;
  Array<double> sums_;

  // Arrays for rendered rays, and for the search of start cells.
  GpuRenderer<Machine, BatchRay> renderer_;
  Array<float> lower_sh_;
  Array<Eigen::Vector3d> origins_;
  Array<uint32_t> start_cells_;
};

}  // namespace semfoam
