// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/optim/densification.h"
#include "foam/optim/optimizer.h"
#include "foam/optim/training_topology.h"
#include "foam/render/ray_batch.h"
#include "foam/render/ray_caster.h"
#include "foam/util/device_kind.h"

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The state of a training in the host's memory.
struct TrainingState {
  Foam foam;
  std::unique_ptr<FoamOptimizer> optimizer;
  DensificationStatistics densification;
  TrainingTopology topology;
};

// Input of one iteration.
struct TrainingStep {
  // Rays with their start cells in the current topology (StartCells).
  const std::vector<BatchRay>& rays;
  RayLossWeights weights;
  // Optical depth at which rays stop.
  float cutoff_tau = 0;
  // Weight of the total variation; 0 = skip it in this iteration.
  double tv_weight = 0;
  LearningRates rates;
};

// Result of one iteration.
struct TrainingStepResult {
  BatchTotals batch;
  // Unweighted; 0 where the total variation was skipped.
  double tv_loss = 0;
  // Number of cells, the classifier counted as one, whose gradient was not finite.
  int64_t skipped_updates = 0;
};

// Computes the iterations of a training: on the CPU, or on a GPU that keeps the state in its own
// memory. The trainer calls Download() or DownloadSites() before it reads the host's state and
// Upload() after it has changed it; it does not need to know where the state is kept.
class TrainingDevice {
 public:
  virtual ~TrainingDevice() = default;

  virtual DeviceKind Kind() const = 0;

  // Copies the full training state, including face planes, from device to host.
  virtual void Download() = 0;

  // Copies positions and densification statistics from device to host: all that a triangulation or
  // a densification plan reads.
  virtual void DownloadSites() = 0;

  // Copies the state, without the topology, from host to device. Sizes may differ from before.
  virtual void Upload() = 0;

  // Applies a densification to the state on the device: semfoam::Rearrange with its default
  // options, FoamOptimizer::Rearrange, and cleared statistics. On the host only the number of
  // positions changes. Must be followed by UploadTopology() of the new sites and HoldDensities().
  virtual void Rearrange(const Rearrangement& plan) = 0;

  // Copies the topology, including face planes, from host to device. To be called after Upload() or
  // Rearrange() where the number of sites has changed.
  virtual void UploadTopology() = 0;

  // Applies HeldRawDensity to the raw densities on the device, with the device's topology.
  virtual void HoldDensities() = 0;

  // Iterations that may run on the old topology while a new one is computed on the host; the new
  // one is taken over after exactly as many, however long it took. 0 = synchronous.
  virtual int TriangulationLag(size_t /*num_sites*/) const { return 0; }

  // Recomputes the face planes from the current sites (semfoam::Refresh).
  virtual void FollowSites() = 0;

  // Finds the cell of each origin by the current planes. `cells` holds the cells to search from,
  // and then the result; indices out of range search from any cell.
  virtual void StartCells(const std::vector<Eigen::Vector3d>& origins,
                          std::vector<uint32_t>* cells) = 0;

  // Casts the rays forward and backward and updates all parameters.
  virtual TrainingStepResult Step(const TrainingStep& step) = 0;

  // Renders the rays with SH coefficients up to `sh_degree` only, at most the foam's degree.
  virtual std::vector<RenderedRay> Render(const std::vector<BatchRay>& rays, int sh_degree) = 0;
};

}  // namespace semfoam
