// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/pixel_cache.h"
#include "foam/optim/densification.h"
#include "foam/optim/free_space.h"
#include "foam/optim/training_device.h"
#include "foam/render/ray_batch.h"
#include "foam/train/checkpoint.h"
#include "foam/train/trainer.h"
#include "foam/train/training_guard.h"
#include "foam/train/training_rays.h"
#include "foam/train/training_schedule.h"

#include <chrono>
#include <cstdint>
#include <future>
#include <memory>
#include <vector>

namespace semfoam {

// Runs one training: schedules iterations, densification, triangulation, the SH degree, evaluation
// and checkpoints. Rays are cast and parameters updated by a TrainingDevice. Included by trainer.cc
// (iterations), trainer_topology.cc (densification and topology), trainer_sh_degree.cc and
// trainer_checkpoint.cc only.
class Trainer {
 public:
  // Throws UserError where there is no photo to train on.
  Trainer(const TrainingViews& views,
          const std::vector<SeedPoint>& seeds,
          const TrainingOptions& options,
          const TrainingHooks& hooks);

  // Exactly one of these must be called before Run().
  void Begin(const std::vector<SeedPoint>& seeds, int num_classes);
  void Resume(int num_classes, std::unique_ptr<const Checkpoint> checkpoint);

  TrainingSummary Run(const TrainingHooks& hooks);

 private:
  void Save(CheckpointContents* contents);
  template <typename Archive>
  void SerializeNumbers(Archive* archive);
  template <typename Archive>
  void SerializePending(Archive* archive);
  template <typename Archive>
  void SerializeArrays(size_t num_sites, size_t num_reports, Archive* archive);
  void RequireSameRun(int num_classes, const Checkpoint& checkpoint) const;

  // Ranges in the PixelCache.
  enum { kAllButProbes, kAllViews };

  int TriangulationLag(size_t num_sites) const;
  void UpdateTopology();
  bool TopologyIsStale() const;
  bool DensificationIsDue() const;
  Rearrangement PlanNextDensification();
  void CarryOut(const Rearrangement& densification);
  void BeginTriangulation(Rearrangement plan);
  void StartTriangulating();
  void TakeOverTriangulation();
  void Retriangulate();
  void HandOverTopology(int64_t iteration);
  void ChooseViews();
  void MakeCache();
  int RangeInCache() const { return probe_pixels_.size() > 0 ? kAllButProbes : kAllViews; }
  std::vector<int> RangesAt(int64_t iteration) const;
  std::vector<ViewPixel> ProbePixels() const;
  void DrawBatch();
  void Iterate();
  void ChooseShDegreeIfDue();
  void SetShDegree(int degree);
  void SettleShDegree(int degree);
  bool ShDegreePays() const;
  void EvaluateIfDue();
  void Report(const TrainingHooks& hooks);

  double RunFraction() const { return schedule_.RunFraction(progress_.iteration); }
  bool PositionsMove() const { return schedule_.PositionsMove(progress_.iteration); }
  // Returns start_cells_ with the cells of `views` searched again.
  std::vector<uint32_t> StartCellsWith(const std::vector<int>& views) const;

  // Declared first, because the seconds of a run include the construction of the other members.
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  const TrainingViews& views_;
  const TrainingOptions& options_;
  const std::vector<int> views_to_train_on_;
  PixelRange pixels_;                  // to train on
  PixelRange probe_pixels_;            // to settle the SH degree on; empty when that is done
  std::unique_ptr<PixelCache> cache_;  // of views that do not fit into memory
  size_t num_probes_kept_ = 0;         // the first of the pixels that it keeps
  const FreeSpace free_space_;
  TrainingSchedule schedule_;

  // As of the last Download; sizes (sites, classes, SH degree) are always current.
  TrainingState state_;
  std::unique_ptr<TrainingDevice> device_;
  int densifications_ = 0;

  // A triangulation computed while iterations run.
  struct PendingTriangulation {
    int64_t iteration = 0;  // when it was asked for
    // Its positions are triangulated. A densification takes effect with the new topology; without
    // an origin the sites stay those that there are.
    Rearrangement plan;
    std::future<TrainingTopology> topology;  // goes first, and waits for what reads the positions
  };
  std::unique_ptr<PendingTriangulation> pending_;
  std::vector<uint32_t> start_cells_;  // per view: where its camera was last
  int64_t last_triangulation_ = 0;     // iteration
  int64_t triangulated_sites_ = 0;     // after the first triangulation
  bool frozen_ = false;
  bool sh_degree_is_settled_ = false;
  int evaluations_ = 0;
  double seconds_evaluating_ = 0;
  double seconds_reading_ = 0;  // before the first iteration

  std::vector<BatchRay> rays_;
  BatchTotals batch_;  // the last one
  TrainingGuard guard_;

  TrainingSummary summary_;
  TrainingProgress progress_;
  double last_report_ = 0;  // seconds since begin_
  RayLossTerms<double> loss_sum_;
  double tv_sum_ = 0;
  int64_t loss_count_ = 0, tv_count_ = 0;
};

}  // namespace semfoam
