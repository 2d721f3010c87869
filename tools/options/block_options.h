// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/cli/option_manager.h"
#include "tools/controllers/block_run.h"
#include "tools/options/training_run_options.h"

#include <cstdint>
#include <filesystem>
#include <string>

namespace semfoam {

// Options of a training in blocks. scene_splitter takes them and writes those that were given into
// project.ini, from which the trainings of the blocks and the merge read them.
struct BlockRunOptions {
  std::string workspace_path;
  TrainingRunOptions training;
  // "3x2"; empty: by SplitOptions::max_sites.
  std::string blocks;
  // -1: by TrainingOptions::final_sites.
  int64_t coarse_sites = -1;
  // 0: by SplitOptions::coarse_sites.
  double coarse_share = 0;
  // 0, 1, or -1: see SplitOptions::polishes_blocks.
  int polish_by_block = -1;
  SplitOptions split;
};

// Adds --workspace_path, --image_path, --input_path, --blocks, --max_sites, --coarse_sites,
// --coarse_share, --polish_share, --polish_by_block and the options of AddTrainingRunOptions.
void AddBlockRunOptions(OptionManager* options, BlockRunOptions* run);

// Completes `run` after Parse. Throws UserError when an option is out of range.
void FinishBlockRun(const OptionManager& options, BlockRunOptions* run);

// The project file in the folder of a split.
std::filesystem::path ProjectPath(const std::filesystem::path& blocks_path);

// Reads the options of the run in the folder of a split, and completes them. Throws UserError where
// there is none.
TrainingRun ReadBlockRun(const std::filesystem::path& blocks_path);

}  // namespace semfoam
