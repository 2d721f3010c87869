// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/optim/training_device.h"
#include "foam/render/ray_batch.h"
#include "foam/train/camera_cells.h"
#include "foam/train/checkpoint.h"
#include "foam/train/sh_degree_selector.h"
#include "foam/train/topology_updater.h"
#include "foam/train/trainer.h"
#include "foam/train/training_evaluation.h"
#include "foam/train/training_guard.h"
#include "foam/train/training_log.h"
#include "foam/train/training_pixels.h"
#include "foam/train/training_schedule.h"
#include "foam/util/rank_group.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace semfoam {

// Runs one training: draws the rays of each iteration, passes them to a TrainingDevice, and after
// each iteration updates the SH degree, the topology, evaluations and reports. Included by
// trainer.cc (iterations) and trainer_checkpoint.cc (saving and resuming) only.
class Trainer {
 public:
  // The arguments must outlive this object. Throws UserError where there is no photo to train on.
  Trainer(const TrainingViews& views,
          const std::vector<SeedPoint>& seeds,
          const TrainingOptions& options,
          const TrainingHooks& hooks);

  // Start a new run or restore a checkpoint. Exactly one of these must be called before Run().
  void Begin(const std::vector<SeedPoint>& seeds, int num_classes);
  void Resume(int num_classes, std::unique_ptr<const Checkpoint> checkpoint);

  // Trains to the end. Must be called once.
  TrainingSummary Run(const TrainingHooks& hooks);

 private:
  // Takes an iteration, and does all that is due after it. Returns whether another one follows.
  // Where a rank is lost, the state stays as between two iterations, for the hook that saves it.
  bool IterateAndUpdate(const TrainingHooks& hooks, const TrainingHooks::Save& save);
  void OpenPixelCache();
  void ReadPixels(const TrainingHooks& hooks);
  void Iterate();
  // Chooses the number of iterations by the time on rank 0.
  void FitToSecondsIfDue();
  // Throws UserError, from time to time, where a rank holds another foam than rank 0.
  void RequireOneFoam();
  // Returns a function that renders with the foam as it is; to be called before it changes.
  TrainingHooks::RenderPixels PixelRenderer();
  void AdaptViewsIfDue(const TrainingHooks& hooks);
  void ClearHangingCellsIfDue();
  TrainingSummary Finish(const TrainingHooks& hooks);

  void Save(CheckpointContents* contents);
  void RequireSameRun(int num_classes, const Checkpoint& checkpoint) const;
  template <typename Archive>
  void SerializeNumbers(Archive* archive);
  template <typename Archive>
  void SerializeArrays(size_t num_sites, size_t num_reports, Archive* archive);
  // Describes what makes this the run of one block (block_checkpoint.h).
  template <typename Archive>
  void SerializeBlock(size_t num_sites, Archive* archive);

  bool TrainsBlock() const { return !state_.is_frozen.empty(); }

  // Declared first, because the seconds of a run include the construction of the other members.
  TrainingLog log_;
  const TrainingViews& views_;
  const TrainingOptions& options_;
  TrainingSchedule schedule_;
  TrainingPixels pixels_;
  // The state at the last Download; sizes (sites, classes, SH degree) are always current.
  TrainingState state_;
  std::unique_ptr<TrainingDevice> device_;
  // Null: this process trains alone.
  RankGroup* const ranks_;
  CameraCells camera_cells_;
  TopologyUpdater topology_;
  ShDegreeSelector sh_degree_;
  HeldOutEvaluator evaluator_;
  TrainingGuard guard_;
  // Number of calls of TrainingHooks::adapt_views so far.
  int num_adaptations_ = 0;
  // Number of searches for hanging cells so far.
  int num_hanging_cell_searches_ = 0;
  // The rays of the last iteration.
  std::vector<BatchRay> rays_;
  // The parts of the result that no other member holds.
  TrainingSummary summary_;
};

}  // namespace semfoam
