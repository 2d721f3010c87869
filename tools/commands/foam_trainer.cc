// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/error.h"
#include "foam/util/rank_group.h"
#include "tools/cli/mpi_ranks.h"
#include "tools/cli/rank_command.h"
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
#include "tools/support/value_text.h"

#include <exception>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Trains a block of a split, in its folder, or its part of the end of the run.
void TrainBlockIn(const std::filesystem::path& block_path,
                  bool polish,
                  CheckpointOptions checkpoints,
                  const OptionManager& options) {
  options.RequireOnly(
      {"block_path", "polish", "checkpoint_every", "preview_every", "resume", "overwrite"},
      "with --block_path, which has the options of scene_splitter");
  const std::filesystem::path path = std::filesystem::absolute(block_path / "").parent_path();
  TrainingRun run = ReadBlockRun(path.parent_path());
  const char* const done = polish ? " is polished" : " is trained";
  if ((polish ? IsPolished(path) : IsTrained(path)) && !checkpoints.overwrite) {
    LOG(INFO) << path.string() << done << " already.";
    return;
  }
  // A scheduler that starts a job again gives the same command.
  if (!options.IsGiven("resume")) checkpoints.resume = HoldsStoppedTraining(path);
  TrainingFolder folder(path, checkpoints, ResumeCommand(options));
  if (polish) {
    PolishBlock(&folder, &run);
  } else {
    TrainBlock(&folder, &run);
  }
  folder.Finish();
  LOG(INFO) << path.string() << done << ".";
}

// Trains a foam and writes all that foam_trainer writes; `ranks` null: this process alone.
void TrainFoamIn(const std::string& output_path,
                 const CheckpointOptions& checkpoints,
                 const OptionManager& options,
                 RankGroup* ranks,
                 TrainingRunOptions* training) {
  FinishTrainingRun(options, {}, training);
  if (ranks != nullptr) {
    if (training->run.device.gpu()) {
      throw FieldError(
          "mpi", " is 1, and ", Field{"device"}, " is a GPU; cpu would be right for both.");
    }
    training->run.ranks = ranks;
  }
  RequireSeedCloudIsKept(*training, output_path);

  TrainingFolder folder(output_path, checkpoints, ResumeCommand(options), IsFirstRank(ranks));
  if (FromFirstRank(ranks, IsFirstRank(ranks) && folder.IsFinished())) {
    if (IsFirstRank(ranks)) WarnOfOtherNames(output_path, training->masks.labels_path);
    return;
  }
  if (IsFirstRank(ranks)) folder.RequireReplaceable();
  const std::filesystem::path foam_path = folder.path() / "scene.foam";
  training->run.when_written = DrawTrainingPlot;
  Model model = TrainAndWrite(&folder, &training->run);
  if (!IsFirstRank(ranks)) return;
  TakeLabelNames(foam_path, {}, {}, &model);
  WriteLabels(PrepareExport(model, foam_path),
              output_path,
              {ModelChecksum(foam_path), {}, /*is_new_foam=*/true});
  folder.Finish();
}

// Returns whether the command line says --mpi 1. Known before the options are read, so that an
// error in them is printed by one rank as well.
bool AsksForRanks(int argc, char** argv) {
  constexpr std::string_view kName = "--mpi";
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    if (!word.starts_with(kName)) continue;
    const std::string_view rest = word.substr(kName.size());
    std::string value;
    if (rest.empty() && i + 1 < argc) value = argv[i + 1];
    if (rest.starts_with('=')) value = rest.substr(1);
    bool mpi = false;
    if (ParseValue(value, &mpi)) return mpi;
  }
  return false;
}

}  // namespace

void RunFoamTrainer(int argc, char** argv) {
  std::string output_path;
  std::string block_path;
  TrainingRunOptions training;
  CheckpointOptions checkpoints;
  bool mpi = false;
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
  bool polish = false;
  options.AddDefaultOption("polish",
                           &polish,
                           "with --block_path, 1 = train the end of the run on the block, whose "
                           "neighbours are trained; foam_merger does so with all that are left");
  AddTrainingRunOptions(&options, &training);
  AddCheckpointOptions(&options, &checkpoints);
  options.AddDefaultOption(
      "mpi",
      &mpi,
      "1 = this process is one of those that mpirun has started, on machines that see the same "
      "files, to train one foam together, with the same result; needs a build with MPI. Does not "
      "pay over 1 Gb/s, where it takes twice as long as one machine; saves some 5 % over 10 Gb/s "
      "and up to a quarter over 100 Gb/s");
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
  std::exception_ptr refusal;
  try {
    if (!options.Parse(argc, argv)) return;
  } catch (const UserError&) {
    if (!AsksForRanks(argc, argv)) throw;
    refusal = std::current_exception();
    mpi = true;
  }
  const std::unique_ptr<RankGroup> ranks = mpi ? JoinMpiRanks() : nullptr;
  RunOnRanks(ranks.get(), [&] {
    if (refusal != nullptr) std::rethrow_exception(refusal);
    if (options.IsGiven("block_path")) {
      return TrainBlockIn(block_path, polish, checkpoints, options);
    }
    if (polish) {
      throw FieldError("polish",
                       " is 1, which is for a block; ",
                       Field{"block_path"},
                       " with it would be right.");
    }
    TrainFoamIn(output_path, checkpoints, options, ranks.get(), &training);
  });
}

}  // namespace semfoam
