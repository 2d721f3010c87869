// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "foam/data/solid_ground.h"
#include "foam/device/device.h"
#include "foam/model/model.h"
#include "foam/train/trainer.h"
#include "foam/util/rank_group.h"
#include "plugin/dataset/scene_options.h"
#include "plugin/dataset/training_scene.h"
#include "plugin/photometric/effects.h"
#include "tools/controllers/presets.h"
#include "tools/controllers/training_folder.h"

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace semfoam {

inline constexpr EnumName<MaskConsistency> kMaskConsistencyNames[] = {
    {MaskConsistency::kAuto, "auto"},
    {MaskConsistency::kOff, "off"},
    {MaskConsistency::kTracks, "tracks"},
    {MaskConsistency::kIndependent, "independent"}};

// Ends a training before its end, whose state the thrower has written.
struct TrainingStopped {};

// What is known when a training has been stopped so.
struct TrainingAtStop {
  const TrainingScene& scene;
  const std::vector<SeedPoint>& seeds;
  const SceneEffects& effects;
  // The options of the model that the run would end with.
  const std::map<std::string, std::string>& model_options;
};

// The input and options of a training. The seed is that of `training`; CompleteTrainingRun copies
// the values that `scene`, `training` and `effects` have in common.
struct TrainingRun {
  SceneOptions scene;
  // Name of the preset that `training` was made from (OptionsForQuality), to be stored in the
  // model.
  Quality quality = Quality::kMedium;
  TrainingOptions training = OptionsForQuality(Quality::kMedium);
  // Number of seconds for all of TrainAndWrite, > 0: chooses the options that presets set, except
  // `kept_options`, by the speed of this machine. 0: use those of `training`.
  double time_budget = 0;
  // Names of fields of TrainingOptions, such as "num_rays".
  std::set<std::string> kept_options;
  EffectsOptions effects;
  // Maximum number of photos that are swept for points on surfaces without SfM points
  // (AddSurfaceSeeds); 0: none. A time budget limits it to one photo for two seconds of the budget.
  int sweep_photos = 150;
  // See PlanImageMemory.
  double image_cache_gb = -1;
  // Device to train on.
  Device device;
  // The processes that train together, of which this is one, on the CPU; null: this one alone.
  RankGroup* ranks = nullptr;

  // Returns the path of a checkpoint to begin from instead of the beginning, where there is none to
  // resume from; empty: begin anew. Called when the photos' headers are read.
  std::function<std::filesystem::path()> begin_from;
  // The seeds of a run that trains one block (SeedsOf); empty: those of the scene, and of a plane
  // sweep.
  std::vector<SeedPoint> block_seeds;
  // What things stand on in the run of which one block is trained (GroundOf).
  std::optional<SolidGround> block_ground;
  // Number of sites of a run that is to be split into blocks that add the others, and the share of
  // it that is trained before (OptionsOfCoarse); 0: training.final_sites.
  int coarse_sites = 0;
  double coarse_share = 0;
  // See TrainingHooks.
  double adapted_part = 1;
  // Number of sites of a run that trains one block, to plan its memory; 0: training.final_sites.
  int64_t block_sites = 0;
  // Names of the photos of which a run that trains one block draws pixels, and the file of what is
  // known of all photos (ReadSceneFindings), so that the others need not be read; empty: all are.
  std::vector<std::string> block_photos;
  std::filesystem::path known_findings;
  // File for what is looked up in the photos (WriteSceneFindings); empty: none.
  std::filesystem::path findings_path;
  // File of what the plane sweep of the run has found, of which this run is a part
  // (ReadSurfaceSeeds), so that it does not sweep; empty: it does. And the file to write that into;
  // empty: none.
  std::filesystem::path known_sweep;
  std::filesystem::path sweep_path;
  // Parts of a checkpoint's identity besides options and inputs.
  std::map<std::string, std::string> more_identity;
  // Called, unless empty, as TrainingHooks::between_iterations, before checkpoints are written. May
  // throw TrainingStopped: then `when_stopped` is called, unless empty, when the training's memory
  // is free again, and TrainAndWrite throws TrainingStopped.
  std::function<void(int64_t iteration, const TrainingHooks::Save& save)> between_iterations;
  std::function<void(const TrainingAtStop&)> when_stopped;
  // See TrainingHooks.
  RayFilter measured_rays;
  // Called, unless empty, in place of writing the result, with it and the reports of the log.
  std::function<void(const Model&, const std::vector<TrainingProgress>&)> take_result;

  // Called, unless empty, when the scene is planned, before photos are read, and when the labels
  // are known, before the training: may throw to refuse a run that would only fail afterwards.
  std::function<void(const ScenePlan&)> when_planned;
  std::function<void(const std::vector<Label>&)> when_labels_are_known;
  // Called, unless empty, after a training with a time budget, with the names and values of the
  // TrainingOptions that the budget has chosen: given without a budget, these make the same foam.
  std::function<void(const std::vector<std::pair<std::string, std::string>>&)>
      when_schedule_is_known;
  // Called, unless empty, when scene.foam, effects.json and training_log.csv are written, before
  // TrainingFolder::EndTraining, with the reports of the log.
  std::function<void(const std::vector<TrainingProgress>&, const TrainingFolder&)> when_written;
  // Called, unless empty, with each report of the training, about once a second, from the thread of
  // TrainAndWrite. Returns whether to go on; if not, the training ends after the current iteration
  // with a checkpoint and throws Interruption(SIGINT).
  std::function<bool(const TrainingProgress&)> when_reported;
};

// Sets the paths of `run->scene` that are empty to the usual folders of COLMAP and mask trackers in
// `workspace`: images/, sparse/, object_mask/ or Annotations/. Throws UserError where `workspace`
// is no folder.
void CompleteFromWorkspace(const std::filesystem::path& workspace, TrainingRun* run);

// Writes the model with the poses of `photos` into `model_path`, beside a text by which later runs
// know it, where the effect `poses` is on; else removes that of the foam that was there before.
// Models of others stay, with a warning. `input_path`: the model of the run.
void WriteRefinedPoses(const std::filesystem::path& input_path,
                       const std::vector<PhotoRecord>& photos,
                       const Effect& poses,
                       const std::filesystem::path& model_path);

// Copies the seed, the SH degree and the choices of `effects` to the other fields that need them.
// Throws UserError, naming field and range, when a value is out of range. Must be called before any
// work.
void CompleteTrainingRun(TrainingRun* run);

// Copies from `schedule` the options that presets set, which determine length, size and detail of a
// training, except `kept_options`.
void TakeSchedule(const TrainingOptions& schedule,
                  const std::set<std::string>& kept_options,
                  TrainingOptions* training);

// Returns names and values of the options of the schedule, in a fixed order: given without a
// budget, they give the same bytes on any machine.
std::vector<std::pair<std::string, std::string>> ScheduleTexts(const TrainingOptions& training);

// Loads the dataset of `scene`, within run.image_cache_gb.
TrainingScene LoadScene(const TrainingRun& run, const SceneOptions& scene);

// Returns whether a plane sweep looks for surfaces: not with run.sweep_photos 0 or a dense cloud
// (run.scene.seed_path), which takes its place.
bool Sweeps(const TrainingRun& run);

// What a plane sweep found.
struct SweepFindings {
  // A line about it; empty where nothing was swept.
  std::string report;
  // What it says of sky ("not looked for" where nothing was swept).
  Effect sky;
};

// Adds the surface points of a plane sweep (FindSurfaceSeeds), or of a known one, to the seeds of
// `scene`, whose lights must have been set before, and sets its depths. Does nothing unless run
// Sweeps. Where one block is trained, sets the ground of the run and the depths of the photos that
// are drawn alone.
SweepFindings AddSurfaceSeeds(const TrainingRun& run, TrainingScene* scene);

// Logs the warnings about a dataset: those of its plan and its own.
void LogWarnings(const TrainingScene& scene);

// Logs what masks a scene has, what their correction by the tracks, if asked for, has changed, and
// whether id 0 is a class.
void LogMasks(const TrainingScene& scene, MaskConsistency consistency);

// Loads the photos and masks, probes the effects, logs the findings and the plan, trains, and
// writes scene.foam, effects.json and training_log.csv into `folder`, and checkpoints during the
// training. With CheckpointOptions::resume, continues where an earlier process was stopped, also
// after the training; the result has the same bytes, except for the log. SIGINT and SIGTERM (after
// HandleInterruptions) end it after the current iteration, with a checkpoint and a log line with
// the resume command. Masks of other formats (ImportMasksOf) are converted into imported_masks/ in
// the folder first. Returns the model. The model's options are those that shape the result:
// quality, random_seed, test_every, mask_consistency and the training's, with the maximum SH degree
// of the training; and "exposure" and "vignetting", if they are on. With a time budget, `run` and
// the model receive the chosen schedule. Throws UserError for errors in the input, Interruption
// after a signal.
//
// Several ranks (TrainingRun::ranks) train the same foam, with the bytes of one. All must
// see the same files under the same paths. Rank 0 writes and decides; the others, whose `folder`
// does not write, return an empty model. A signal to any of them ends all. Where one is lost, rank
// 0 writes a checkpoint, logs the resume command, and throws LostRank.
Model TrainAndWrite(TrainingFolder* folder, TrainingRun* run);

}  // namespace semfoam
