// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/optim/densification.h"
#include "foam/optim/free_space.h"
#include "foam/optim/training_device.h"
#include "foam/render/ray_batch.h"
#include "foam/train/camera_cells.h"
#include "foam/train/checkpoint.h"
#include "foam/train/trainer.h"
#include "foam/train/training_options.h"
#include "foam/train/training_schedule.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

// Adds, prunes and triangulates the sites in the course of a training.

namespace semfoam {

// Densifies a foam in training and keeps its topology up to date:
// - face planes are recomputed every other iteration;
// - TrainingOptions::densify_events densifications are spread evenly over [densify_from,
//   densify_until], each followed by a triangulation; later, where cells have not been watched for
//   long enough since the one before;
// - in between, the sites are triangulated anew when rays show that the topology is stale, and a
//   last time when positions freeze.
//
// A triangulation may run in a separate thread while iterations continue with the old topology. Its
// result is used after exactly TriangulationLag() iterations, and all decisions are based on counts
// of iterations, sites and segments: so the results depend neither on the machine's speed nor on
// the number of threads.
class TopologyUpdater {
 public:
  // `views` and `seeds` determine the space that stays empty (FreeSpace). `options`, `schedule` and
  // the objects behind the pointers must outlive this object; `camera_cells` are reset when sites
  // change their order.
  TopologyUpdater(const TrainingViews& views,
                  const std::vector<SeedPoint>& seeds,
                  const TrainingOptions& options,
                  const TrainingSchedule& schedule,
                  CameraCells* camera_cells,
                  TrainingState* state,
                  TrainingDevice* device);
  // Waits for a running triangulation.
  ~TopologyUpdater();
  TopologyUpdater(const TopologyUpdater&) = delete;
  TopologyUpdater& operator=(const TopologyUpdater&) = delete;

  // Triangulates the device's sites and copies the topology to the device. Must be called before
  // the first iteration.
  void Triangulate(int64_t iteration);

  // Records the numbers of segments and of clamped segments of a batch, which show when the
  // topology is stale. Must be called for every batch that is not empty.
  void Observe(const BatchTotals& batch);

  // Does what is due after `iteration` iterations. Must be called after every iteration.
  void Update(int64_t iteration);

  // Waits for a running triangulation and discards it, at the end of the run.
  void Abandon();

  // Writes the numbers of this class to the summary.
  void Summarize(TrainingSummary* summary) const;

  // Describes the numbers (checkpoint_state.h).
  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Number("pieces", &num_segments_);
    archive->Number("triangulations", &num_triangulations_);
    archive->Number("seconds_triangulating", &seconds_triangulating_);
    archive->Number("densifications", &num_densifications_);
    archive->Number("watched_since", &watched_since_);
    archive->Number("last_triangulation", &last_triangulation_);
    archive->Number("triangulated_sites", &triangulated_sites_);
    archive->Number("frozen", &is_frozen_);
    archive->Number("batch_pieces", &batch_segments_);
    archive->Number("batch_clamped_pieces", &batch_clamped_segments_);
  }

  // Adds to a checkpoint the positions of the sites at the last triangulation and at the last
  // computation of the planes, and the input of a running triangulation. Reads the host's state.
  void Save(CheckpointContents* contents) const;

  // The sites of a checkpoint's topology.
  struct SavedSites {
    // [N] Positions at the last triangulation.
    std::vector<Eigen::Vector3f> triangulated;
    // [N] Positions at the last computation of the planes.
    std::vector<Eigen::Vector3f> planes;
  };

  // Reads what Save has added, for the host's sites and `iteration` iterations done. Throws
  // DamagedCheckpoint where it does not belong to these or a site is out of bounds.
  SavedSites Read(const Checkpoint& checkpoint, int64_t iteration);

  // Recomputes the topology, uploads it with the whole state to the device, and restarts the
  // triangulation that was running.
  void Restore(const SavedSites& sites);

 private:
  struct PendingTriangulation;

  int TriangulationLag(size_t num_sites) const;
  bool NeedsAreas() const { return options_.NeedsAreas(state_->foam.num_classes); }
  bool PositionsMove(int64_t iteration) const { return schedule_.PositionsMove(iteration); }
  bool TopologyIsStale(int64_t iteration) const;
  bool DensificationIsDue(int64_t iteration) const;
  Rearrangement PlanNextDensification();
  void CarryOut(const Rearrangement& densification, int64_t iteration);
  void Begin(int64_t iteration, Rearrangement plan);
  void StartThread();
  void TakeOver(int64_t iteration);
  void HandOver(int64_t iteration);

  const TrainingOptions& options_;
  const TrainingSchedule& schedule_;
  const FreeSpace free_space_;
  CameraCells* const camera_cells_;
  TrainingState* const state_;
  TrainingDevice* const device_;

  // The running triangulation; null: none.
  std::unique_ptr<PendingTriangulation> pending_;
  // Number of densifications planned so far.
  int num_densifications_ = 0;
  // The iteration from which on the device has gathered the statistics of the next one.
  int64_t watched_since_ = 0;
  // The iteration whose sites were triangulated last.
  int64_t last_triangulation_ = 0;
  int64_t num_triangulations_ = 0;
  // Sum of the numbers of sites of all triangulations but the first and those of densifications.
  int64_t triangulated_sites_ = 0;
  // Seconds that iterations waited for triangulations.
  double seconds_triangulating_ = 0;
  // Whether the last triangulation has begun; the sites no longer move.
  bool is_frozen_ = false;
  // Number of segments of all rays so far, of those of the last batch, and of the clamped ones
  // among the latter.
  int64_t num_segments_ = 0;
  int64_t batch_segments_ = 0;
  int64_t batch_clamped_segments_ = 0;
};

}  // namespace semfoam
