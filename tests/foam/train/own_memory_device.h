// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/cpu_device.h"
#include "foam/optim/training_device.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace semfoam {

// The CPU as a device whose memory is its own: it works on a copy of the state, and
// spoils the host's as soon as it has taken it over. So a training ends with other numbers, or
// with none, where the host looks at the state without asking for it, or keeps a change to itself.
class OwnMemoryDevice final : public TrainingDevice {
 public:
  explicit OwnMemoryDevice(TrainingState* host, int triangulation_lag = 0)
      : host_(*host), triangulation_lag_(triangulation_lag) {}

  DeviceKind Kind() const override { return cpu_->Kind(); }

  int TriangulationLag(size_t) const override { return triangulation_lag_; }

  void Download() override {
    Copy(own_, &host_);
    host_.topology = own_.topology;
  }

  void DownloadSites() override {
    host_.foam.positions = own_.foam.positions;
    host_.densification = own_.densification;
  }

  void Upload() override {
    Copy(host_, &own_);
    cpu_->Upload();
    SpoilHost();
  }

  void Rearrange(const Rearrangement& plan) override {
    cpu_->Rearrange(plan);
    host_.foam.positions.resize(own_.foam.NumSites());
    SpoilHost();
  }

  void UploadTopology() override {
    own_.topology = host_.topology;
    cpu_->UploadTopology();
    host_.topology.RefreshPlanes(std::vector<Eigen::Vector3f>(host_.foam.NumSites(), {1, 2, 3}));
  }

  void ClampDensities() override { cpu_->ClampDensities(); }

  void RefreshPlanes() override { cpu_->RefreshPlanes(); }

  void StartCells(const std::vector<Eigen::Vector3d>& origins,
                  std::vector<uint32_t>* cells) override {
    cpu_->StartCells(origins, cells);
  }

  TrainingStepResult Step(const TrainingStep& step) override { return cpu_->Step(step); }

  std::vector<RenderedRay> Render(const std::vector<BatchRay>& rays, int sh_degree) override {
    return cpu_->Render(rays, sh_degree);
  }

 private:
  // All numbers but sizes.
  void SpoilHost() {
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    Foam& foam = host_.foam;
    for (Eigen::Vector3f& site : foam.positions) site.setConstant(kNan);
    for (std::vector<float>* values : {&foam.raw_density,
                                       &foam.classifier_weight,
                                       &foam.classifier_bias,
                                       &host_.densification.squared_error,
                                       &host_.densification.contribution}) {
      std::fill(values->begin(), values->end(), kNan);
    }
    for (auto* values : {&foam.sh, &foam.identity}) std::fill(values->begin(), values->end(), kNan);
    host_.optimizer = std::make_unique<FoamOptimizer>(foam);
  }

  // All but the topology.
  static void Copy(const TrainingState& from, TrainingState* to) {
    to->foam = from.foam;
    to->optimizer = std::make_unique<FoamOptimizer>(*from.optimizer);
    to->densification = from.densification;
  }

  TrainingState& host_;
  const int triangulation_lag_;
  TrainingState own_;
  std::unique_ptr<TrainingDevice> cpu_ = MakeCpuTrainingDevice(&own_);
};

inline std::unique_ptr<TrainingDevice> MakeOwnMemoryDevice(TrainingState* host) {
  return std::make_unique<OwnMemoryDevice>(host);
}

}  // namespace semfoam
