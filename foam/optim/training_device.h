// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/optim/densification.h"
#include "foam/optim/optimizer.h"
#include "foam/optim/training_topology.h"
#include "foam/render/ray_batch.h"
#include "foam/render/ray_caster.h"
#include "foam/util/device_kind.h"
#include "foam/util/rank_group.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

// The interface between the schedule of a training (foam/train) and the processor that computes its
// iterations (foam/device). Lengths are those of the normalised frame.

namespace semfoam {

// The state of a training in the host's memory. N sites.
struct TrainingState {
  // The parameters of all cells.
  Foam foam;
  // Adam's moments of all parameters.
  std::unique_ptr<FoamOptimizer> optimizer;
  // [N] What the next densification is planned from.
  DensificationStatistics densification;
  // Adjacency and face planes of the sites, which lag behind their positions.
  TrainingTopology topology;

  // Of a run that trains one block of the space (foam/train/block_checkpoint.h); both are empty in
  // others.
  //
  // [N] 1: the site lies outside of the block and keeps its parameters; it is neither pruned nor
  // divided.
  std::vector<uint8_t> is_frozen;
  // [N] Index of the site that it was, or descends from, when the space was split.
  std::vector<uint32_t> ancestor;

  // Clears the statistics for the next densification, in which frozen sites count as seen.
  void ResetDensification() { densification.Reset(foam.NumSites(), is_frozen); }
};

// Input of one iteration.
struct TrainingStep {
  // Rays with their start cells in the current topology (StartCells); not empty.
  const std::vector<BatchRay>& rays;
  // Weights of the loss terms of a ray.
  RayLossWeights weights;
  // Optical depth at which rays stop.
  float cutoff_tau = 0;
  // Weight of the total variation of the identities; 0: skip it in this iteration.
  double tv_weight = 0;
  // Weight of the variation of the colours (foam/render/color_variation.h); 0: skip it in this
  // iteration.
  double color_tv_weight = 0;
  // Learning rates of all kinds of parameters.
  LearningRates rates;
};

// Result of one iteration.
struct TrainingStepResult {
  // Losses and counts over the rays.
  BatchTotals batch;
  // Total variation of the identities, unweighted; 0 where it was skipped.
  double tv_loss = 0;
  // Number of cells, the classifier counted as one, whose gradient was not finite and which kept
  // their parameters.
  int64_t skipped_updates = 0;
};

// Computes the iterations of a training: on the CPU, which works on the host's TrainingState in
// place, or on a GPU, which keeps a copy in its own memory. Callers do not need to know which: they
// call Download() or DownloadSites() before they read the host's state and Upload() or
// UploadTopology() after they have changed it. Sizes (sites, classes, SH degree) are always current
// on the host.
//
// Results are deterministic for a kind of device. Sizes that do not match are CHECKed. A device
// whose memory is too small throws UserError. Calls must not overlap.
class TrainingDevice {
 public:
  virtual ~TrainingDevice() = default;

  // Returns what kind of processor it is; results differ between kinds.
  virtual DeviceKind Kind() const = 0;

  // Returns the processes that train together, of which this device serves one; null: this process
  // trains alone.
  virtual RankGroup* ranks() const { return nullptr; }

  // Copies the full training state, including face planes, from device to host.
  virtual void Download() = 0;

  // Copies positions and densification statistics from device to host: all that a triangulation or
  // a densification plan reads.
  virtual void DownloadSites() = 0;

  // Copies the state, without the topology, from host to device. Sizes may differ from before.
  virtual void Upload() = 0;

  // Applies a densification to the state on the device: semfoam::Rearrange with its default
  // options, FoamOptimizer::Rearrange, and cleared statistics. On the host only the number of
  // positions changes. Must be followed by UploadTopology() of the new sites and ClampDensities().
  virtual void Rearrange(const Rearrangement& plan) = 0;

  // Copies the topology, including face planes, from host to device. Must be called after Upload()
  // or Rearrange() where the number of sites has changed.
  virtual void UploadTopology() = 0;

  // Applies ClampedRawDensity to the raw densities on the device, with the device's topology.
  virtual void ClampDensities() = 0;

  // Returns how many iterations run on the old topology while a new one of `num_sites` sites is
  // computed on the host; the new one is taken over after exactly as many, however long it took.
  // 0: iterations wait for it.
  virtual int TriangulationLag(size_t /*num_sites*/) const { return 0; }

  // Recomputes the face planes from the current positions (TrainingTopology::RefreshPlanes); the
  // adjacency stays.
  virtual void RefreshPlanes() = 0;

  // Finds the cells that contain the points `origins` [count], by the current planes. `cells`
  // [count] holds the cells to search from, and then the result; an index out of range starts the
  // search at the last cell.
  virtual void StartCells(const std::vector<Eigen::Vector3d>& origins,
                          std::vector<uint32_t>* cells) = 0;

  // Casts the rays forward and backward, adds to the densification statistics, and takes one step
  // of Adam with all parameters (FoamOptimizer::Step). Where several processes train together
  // (foam/util/rank_group.h), each casts a share of the rays, and all take the same step; throws
  // LostRank, and then the state is as it was before.
  virtual TrainingStepResult Step(const TrainingStep& step) = 0;

  // Renders the rays [count] with SH coefficients up to `sh_degree` only, at most the foam's
  // degree. Rays stop at kTransmittanceCutoff. Returns what each ray shows [count].
  virtual std::vector<RenderedRay> Render(const std::vector<BatchRay>& rays, int sh_degree) = 0;
};

}  // namespace semfoam
