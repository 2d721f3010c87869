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

// When sites are added, pruned and triangulated anew.

namespace semfoam {

// Densifies a foam in training and keeps its topology up to date:
// - face planes follow the sites every other iteration;
// - TrainingOptions::densify_events densifications are spread evenly over [densify_from,
//   densify_until], each followed by a triangulation;
// - in between, the sites are triangulated anew when rays show that the topology is stale, and a
//   last time when positions freeze.
//
// A triangulation may run in a thread of its own while iterations go on with the old topology. It
// is taken over after TriangulationLag() iterations, however long it took, and everything is
// counted in iterations, sites and segments: so the results depend neither on the machine's speed
// nor on the number of threads.
class TopologyUpdater {
 public:
  // `views` and `seeds` decide which space stays empty (FreeSpace). `options`, `schedule` and what
  // the pointers refer to must outlive this; `camera_cells` are reset when sites change their
  // order.
  TopologyUpdater(const TrainingViews& views,
                  const std::vector<SeedPoint>& seeds,
                  const TrainingOptions& options,
                  const TrainingSchedule& schedule,
                  CameraCells* camera_cells,
                  TrainingState* state,
                  TrainingDevice* device);
  // Waits for a triangulation under way.
  ~TopologyUpdater();
  TopologyUpdater(const TopologyUpdater&) = delete;
  TopologyUpdater& operator=(const TopologyUpdater&) = delete;

  // Triangulates the device's sites and hands the topology to the device, at once. To be called
  // before the first iteration.
  void Triangulate(int64_t iteration);

  // Takes from a batch how many segments its rays had, and how many of these were clamped, which
  // tells when a topology is stale. To be called for every batch that is not empty.
  void Observe(const BatchTotals& batch);

  // Does what is due after so many iterations. To be called after every iteration.
  void Update(int64_t iteration);

  // Drops a triangulation under way, after waiting for it: the run ends.
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
    archive->Number("last_triangulation", &last_triangulation_);
    archive->Number("triangulated_sites", &triangulated_sites_);
    archive->Number("frozen", &is_frozen_);
    archive->Number("batch_pieces", &batch_segments_);
    archive->Number("batch_clamped_pieces", &batch_clamped_segments_);
  }

  // Adds to a checkpoint where the sites were when they were triangulated and when their planes
  // were made; of a triangulation under way, what it is made of. Reads the host's state.
  void Save(CheckpointContents* contents) const;

  // The sites of a checkpoint's topology.
  struct SavedSites {
    // [N] When they were triangulated.
    std::vector<Eigen::Vector3f> triangulated;
    // [N] When their planes were made.
    std::vector<Eigen::Vector3f> planes;
  };

  // Reads what Save has added, for the host's sites and so many iterations done. Throws
  // DamagedCheckpoint where it does not belong to these or a site is out of bounds.
  SavedSites Read(const Checkpoint& checkpoint, int64_t iteration);

  // Makes the topology again, uploads it with the whole state to the device, and begins again what
  // was under way.
  void Restore(const SavedSites& sites);

 private:
  struct PendingTriangulation;

  int TriangulationLag(size_t num_sites) const;
  bool PositionsMove(int64_t iteration) const { return schedule_.PositionsMove(iteration); }
  bool TopologyIsStale(int64_t iteration) const;
  bool DensificationIsDue(int64_t iteration) const;
  Rearrangement PlanNextDensification();
  void CarryOut(const Rearrangement& densification);
  void Begin(int64_t iteration, Rearrangement plan);
  void StartThread();
  void TakeOver();
  void HandOver(int64_t iteration);

  const TrainingOptions& options_;
  const TrainingSchedule& schedule_;
  const FreeSpace free_space_;
  CameraCells* const camera_cells_;
  TrainingState* const state_;
  TrainingDevice* const device_;

  // The triangulation under way; null: there is none.
  std::unique_ptr<PendingTriangulation> pending_;
  // How many densifications have been planned.
  int num_densifications_ = 0;
  // The iteration whose sites were triangulated last.
  int64_t last_triangulation_ = 0;
  int64_t num_triangulations_ = 0;
  // Sum of the numbers of sites of all triangulations but the first.
  int64_t triangulated_sites_ = 0;
  // For which iterations waited.
  double seconds_triangulating_ = 0;
  // Whether the last triangulation, of sites that no longer move, has begun.
  bool is_frozen_ = false;
  // Segments of all rays so far; those of the last batch, and how many of these were clamped.
  int64_t num_segments_ = 0;
  int64_t batch_segments_ = 0;
  int64_t batch_clamped_segments_ = 0;
};

}  // namespace semfoam
