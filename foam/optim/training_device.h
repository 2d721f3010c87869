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

// What changes in the course of a training, on the host.
struct TrainingState {
  Foam foam;
  std::unique_ptr<FoamOptimizer> optimizer;
  DensificationStatistics densification;
  TrainingTopology topology;
};

// What one iteration is to do.
struct TrainingStep {
  const std::vector<BatchRay>& rays;  // start cells of now (StartCells)
  RayLossWeights weights;
  float cutoff_tau = 0;  // rays stop at this optical depth
  double tv_weight = 0;  // of the total variation; 0: not in this iteration
  LearningRates rates;
};

// What it did.
struct TrainingStepResult {
  BatchTotals batch;
  double tv_loss = 0;           // unweighted; 0 without tv_weight
  int64_t skipped_updates = 0;  // cells, or the classifier, whose gradient was not finite
};

// Where the iterations of a training are computed: on the CPU, or on a GPU
// that keeps the state in its own memory. The trainer calls Download() or DownloadSites() before it
// looks at the state and Upload() after it has changed it, and knows no more of where it is.
class TrainingDevice {
 public:
  virtual ~TrainingDevice() = default;

  virtual DeviceKind Kind() const = 0;

  // The host's state, the topology's planes included, becomes what the device has.
  virtual void Download() = 0;

  // Of the host's state, the positions and the densification's statistics become what the device
  // has: all that a triangulation or the plan of a densification looks at.
  virtual void DownloadSites() = 0;

  // The device takes over the host's state, which may have other sizes than before. Not the
  // topology.
  virtual void Upload() = 0;

  // Carries out a densification on what the device has: semfoam::Rearrange with its default
  // options, FoamOptimizer::Rearrange, and statistics that begin anew. Of the host's state only the
  // number of positions follows. A topology of the new sites and HoldDensities come next.
  virtual void Rearrange(const Rearrangement& plan) = 0;

  // The device takes over the host's topology, planes included. After Upload or Rearrange, if sites
  // came or went.
  virtual void UploadTopology() = 0;

  // Raw densities of what the device has are held to the topology that it has (HeldRawDensity).
  virtual void HoldDensities() = 0;

  // Sites are triangulated on the host. So many iterations may go on meanwhile with the topology
  // that there is, and the new one is taken over after just so many, however long it took. 0: none
  // goes on.
  virtual int TriangulationLag(size_t /*num_sites*/) const { return 0; }

  // Brings the planes up to date with the sites (Refresh).
  virtual void FollowSites() = 0;

  // For each origin, the cell that it is in as the planes have it. `cells`: near these, or any; a
  // cell that there is no more counts as any.
  virtual void StartCells(const std::vector<Eigen::Vector3d>& origins,
                          std::vector<uint32_t>* cells) = 0;

  // Casts the rays forward and backward and steps all parameters.
  virtual TrainingStepResult Step(const TrainingStep& step) = 0;

  // What rays show of the foam if its colours had no more than `sh_degree`, at most its own.
  virtual std::vector<RenderedRay> Render(const std::vector<BatchRay>& rays, int sh_degree) = 0;
};

}  // namespace semfoam
