// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/checkpoint.h"
#include "foam/util/device_kind.h"
#include "foam/util/rank_group.h"
#include "plugin/dataset/scene_options.h"
#include "tools/controllers/training_folder.h"

#include <filesystem>
#include <memory>

// What the ranks of a run agree on, besides the steps of its training. In all functions `ranks` may
// be null: this process alone. With others, all must make the same calls.

namespace semfoam {

// Converts masks of other formats into `folder` (ImportMasksOf), on rank 0, and sets `scene` on all
// ranks.
void ImportMasksOnce(RankGroup* ranks, const std::filesystem::path& folder, SceneOptions* scene);

// Throws UserError where a rank has another version of the program, other options or other files
// than rank 0.
void RequireOneRun(RankGroup* ranks, const CheckpointTexts& identity);

// Returns TrainingFolder::NewestCheckpoint of rank 0, which all read.
std::unique_ptr<Checkpoint> NewestCheckpointOf(RankGroup* ranks,
                                               DeviceKind device,
                                               TrainingFolder* folder);

// What is to be done after an iteration.
struct AfterIteration {
  // The signal that ends the run; 0: none.
  int signal = 0;
  bool checkpoint_is_due = false;
};

// Returns the signal that any rank has received, that of the lowest one, and whether rank 0 finds a
// checkpoint due.
AfterIteration DecideAfterIteration(RankGroup* ranks, const AfterIteration& own);

}  // namespace semfoam
