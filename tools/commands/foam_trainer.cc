// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/commands/commands.h"
#include "tools/controllers/block_run.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/label_names.h"
#include "tools/controllers/training_folder.h"
#include "tools/controllers/training_run.h"
#include "tools/options/block_options.h"
#include "tools/options/quality_plot.h"
#include "tools/options/training_run_options.h"

#include <filesystem>
#include <string>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Trains a block of a split, in its folder.
void TrainBlockIn(const std::filesystem::path& block_path,
                  CheckpointOptions checkpoints,
                  const OptionManager& options) {
  options.RequireOnly({"block_path", "checkpoint_every", "preview_every", "resume", "overwrite"},
                      "with --block_path, which has the options of scene_splitter");
  const std::filesystem::path path = std::filesystem::absolute(block_path / "").parent_path();
  TrainingRun run = ReadBlockRun(path.parent_path());
  if (IsTrained(path) && !checkpoints.overwrite) {
    LOG(INFO) << path.string() << " is trained already.";
    return;
  }
  // A scheduler that starts a job again gives the same command.
  if (!options.IsGiven("resume")) checkpoints.resume = true;
  TrainingFolder folder(path, checkpoints, ResumeCommand(options));
  TrainBlock(&folder, &run);
  folder.Finish();
  LOG(INFO) << path.string() << " is trained.";
}

}  // namespace

void RunFoamTrainer(int argc, char** argv) {
  std::string output_path;
  std::string block_path;
  TrainingRunOptions training;
  CheckpointOptions checkpoints;
  OptionManager options("foam_trainer",
                        "Trains a foam from a COLMAP model, its photos and instance masks.");
  options.AddRequiredOption("image_path", &training.image_path, "folder of the photos");
  options.AddRequiredOption("input_path", &training.input_path, "the COLMAP model, sparse/0");
  options.AddRequiredOption(
      "output_path",
      &output_path,
      "folder for scene.foam, effects.json, labels.json, training_log.csv and its plot");
  options.AddStandInOption("block_path",
                           &block_path,
                           "instead of all of the above: the folder of a block of scene_splitter, "
                           "which is trained there");
  AddTrainingRunOptions(&options, &training);
  AddCheckpointOptions(&options, &checkpoints);
  options.SetFrequentOptions({"mask_path",
                              "quality",
                              "FoamTraining.num_rays",
                              "FoamTraining.final_sites",
                              "FoamTraining.time_budget",
                              "test_every",
                              "resume",
                              "overwrite",
                              "progress",
                              "num_threads"});
  if (!options.Parse(argc, argv)) return;
  if (options.IsGiven("block_path")) return TrainBlockIn(block_path, checkpoints, options);
  FinishTrainingRun(options, {}, &training);
  RequireSeedCloudIsKept(training, output_path);

  TrainingFolder folder(output_path, checkpoints, ResumeCommand(options));
  if (folder.IsFinished()) {
    WarnOfOtherNames(output_path, training.masks.labels_path);
    return;
  }
  folder.RequireReplaceable();
  const std::filesystem::path foam_path = folder.path() / "scene.foam";
  training.run.when_written = DrawTrainingPlot;
  Model model = TrainAndWrite(&folder, &training.run);
  TakeLabelNames(foam_path, {}, {}, &model);
  WriteLabels(PrepareExport(model, foam_path),
              output_path,
              {ModelChecksum(foam_path), {}, /*is_new_foam=*/true});
  folder.Finish();
}

}  // namespace semfoam
