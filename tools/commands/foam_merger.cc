// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/available_memory.h"
#include "foam/util/freed_memory.h"
#include "tools/commands/commands.h"
#include "tools/controllers/block_export.h"
#include "tools/controllers/block_run.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/label_names.h"
#include "tools/options/block_options.h"
#include "tools/options/quality_plot.h"

#include <filesystem>
#include <string>

#include <glog/logging.h>

namespace semfoam {

void RunFoamMerger(int argc, char** argv) {
  std::string blocks_path;
  std::string output_path;
  CheckpointOptions checkpoints;
  OptionManager options("foam_merger",
                        "Makes one foam of the trained blocks of scene_splitter: trains the end "
                        "of the run, in which the seams close, and joins their sites.");
  options.AddRequiredOption("blocks_path", &blocks_path, "the output folder of scene_splitter");
  options.AddRequiredOption(
      "output_path",
      &output_path,
      "folder for scene.foam, effects.json, labels.json, training_log.csv and its plot");
  AddCheckpointOptions(&options, &checkpoints);
  if (!options.Parse(argc, argv)) return;
  RequireTrained(blocks_path);
  TrainingRun run = ReadBlockRun(blocks_path);
  if (!PolishesBlocks(blocks_path)) RequireKnownSweep(blocks_path, run);

  TrainingFolder folder(output_path, checkpoints, ResumeCommand(options));
  if (folder.IsFinished()) {
    WarnOfOtherNames(output_path, run.scene.labels_path.string());
    return;
  }
  folder.RequireReplaceable();
  const std::filesystem::path foam_path = folder.path() / "scene.foam";
  for (const std::filesystem::path& block_path : UnpolishedBlocks(blocks_path)) {
    TrainingRun of_block = run;
    CheckpointOptions of_blocks = checkpoints;
    of_blocks.resume = HoldsStoppedTraining(block_path);
    TrainingFolder block_folder(block_path, of_blocks, ResumeCommand(options));
    PolishBlock(&block_folder, &of_block);
    block_folder.Finish();
    LOG(INFO) << block_path.string() << " is polished.";
    ReturnFreedMemory();
  }
  run.when_written = DrawTrainingPlot;
  Model model = MergeBlocks(blocks_path, &folder, &run);
  if (PolishesBlocks(blocks_path) &&
      MemoryOfObjects(static_cast<int64_t>(model.foam.NumSites())) > AvailableMemory()) {
    LOG(INFO) << "The objects of all cells at once do not fit into memory: labels.json lists what "
                 "the exports by block know of them.";
    model = {};
    WriteLabelsOfBlocks(blocks_path, foam_path);
  } else {
    TakeLabelNames(foam_path, {}, {}, &model);
    WriteLabels(PrepareExport(model, foam_path),
                output_path,
                {ModelChecksum(foam_path), {}, /*is_new_foam=*/true});
  }
  folder.Finish();
}

}  // namespace semfoam
