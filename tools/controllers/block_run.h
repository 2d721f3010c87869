// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/blocks/foam_blocks.h"
#include "foam/model/model.h"
#include "foam/train/space_blocks.h"
#include "tools/controllers/training_folder.h"
#include "tools/controllers/training_run.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

// Trains a foam in blocks of space, one after the other or on several machines:
//
//   SplitRun    trains the beginning of a run, and cuts it into blocks     B/split.ckpt,
//               and keeps what it looked up in the photos                  B/photos.ckpt
//               and what its plane sweep found                             B/sweep.ckpt
//   TrainBlock  goes on with one of them, most of the run                  B/07/block.ckpt
//   PolishBlock trains its end, with the neighbours' sites around it       B/07/polished.foam
//   MergeBlocks joins the blocks                                           OUT/scene.foam
//
// Of a run that is not polished by block, MergeBlocks trains the end, on the sites of all blocks.
// All have the options, the photos and the schedule of one run, and its checkpoints
// (foam/train/block_checkpoint.h). What is decided once for all blocks - labels, corrected masks,
// exposure, frame, SH degree, classifier - is decided at the beginning of the run.

namespace semfoam {

struct SplitOptions {
  // Number of blocks along the two axes along which the scene is widest, >= 1; 0: by max_sites.
  int columns = 0;
  int rows = 0;
  // Maximum number of sites of the training of a block, with those around it; 0: by columns and
  // rows.
  int64_t max_sites = 0;
  // Maximum number of sites of the foam that is split, less than TrainingOptions::final_sites, to
  // which the blocks add theirs; 0: as many as the schedule of the run gives.
  int64_t coarse_sites = 0;
  // Shares of the run before the split and after the merge, > 0 and together at most 1.
  double coarse_share = 0.3;
  double polish_share = 0.2;
  // Whether the end of the run is trained block by block. Nothing: with coarse_sites it is, unless
  // few photos have labels, which are spread over the whole foam at the end.
  std::optional<bool> polishes_blocks;
};

// One block of a split, as blocks.json describes it.
struct BlockRecord {
  // The name of its folder: "07".
  std::string name;
  BlockBox box;
  // Number of sites that the merged foam will have in its box, about; and maximum number in its
  // training, with halo and frozen ones.
  int64_t own_sites = 0;
  int64_t sites = 0;
  // Share of the run's rays that are drawn in it.
  double ray_share = 0;
  // Photos whose rays are drawn.
  std::vector<std::string> photos;
  // Memory of its training, and its seconds on the machine that made the split.
  int64_t memory_bytes = 0;
  double seconds = 0;
};

// The contents of blocks.json.
struct BlocksRecord {
  // Identifies the split: blocks of another one do not fit.
  std::string split;
  // Iterations before the split, before the merge, and of the run.
  int64_t split_iteration = 0;
  int64_t merge_iteration = 0;
  int64_t num_iterations = 0;
  // In the normalised frame.
  float halo = 0;
  // Whether the end of the run is trained block by block.
  bool polishes_blocks = false;
  std::vector<BlockRecord> blocks;
};

// Reads B/blocks.json. Throws UserError where it is missing, damaged or of another version.
BlocksRecord ReadBlocksRecord(const std::filesystem::path& blocks_path);

// Throws UserError where the options are out of range.
void RequireValid(const SplitOptions& options);

// Throws UserError where a run cannot be trained in such blocks: with a time budget, on a GPU, or
// with fewer sites than coarse_sites.
void RequireSplittable(const SplitOptions& options, const TrainingRun& run);

// Trains the beginning of `run` in `folder` and writes split.ckpt, a folder with start.ckpt for
// each block, and blocks.json, the last of them. Throws UserError and Interruption as TrainAndWrite
// does, and where no number of blocks keeps to max_sites.
BlocksRecord SplitRun(const SplitOptions& options, TrainingFolder* folder, TrainingRun* run);

// Returns whether the block in this folder is trained.
bool IsTrained(const std::filesystem::path& block_path);

// Trains the block in `folder`, with the options of the run that was split, and writes block.ckpt.
// Reads the pixels of its own photos alone; what is to be known of the others, the split has looked
// up. Throws as TrainAndWrite does.
void TrainBlock(TrainingFolder* folder, TrainingRun* run);

// Throws UserError where a block below `blocks_path` is not trained, incomplete, or of another
// split.
void RequireTrained(const std::filesystem::path& blocks_path);

// Trains the end of the run on the block in `folder` and the sites of other blocks around it, and
// writes the former to polished.foam, and its training_log.csv. Throws as TrainBlock does, where a
// block is not trained that has sites there, and where the split is not polished by block.
void PolishBlock(TrainingFolder* folder, TrainingRun* run);

// Returns whether the blocks of a split are polished one by one.
bool PolishesBlocks(const std::filesystem::path& blocks_path);

// Returns whether that is done in this folder of a block.
bool IsPolished(const std::filesystem::path& block_path);

// Returns the paths of the blocks that are to be polished before MergeBlocks; none where the split
// is not polished by block.
std::vector<std::filesystem::path> UnpolishedBlocks(const std::filesystem::path& blocks_path);

// Returns the path of the file with what the foams of all blocks have in common: labels, photos,
// frame, options and classifier, as a model without cells.
std::filesystem::path RunPath(const std::filesystem::path& blocks_path);

// Returns what identifies the foam in blocks: the checksum of that file, as its split determines
// the foam, or another once all blocks are polished.
std::string ChecksumOfBlocks(const std::filesystem::path& blocks_path);

// Opens the trained blocks, if all are polished these, for exports that hold one of them at a time.
// Throws as RequireTrained
// does, and where the file of RunPath is missing, damaged or of another split.
FoamBlocks OpenBlocks(const std::filesystem::path& blocks_path);

// Throws UserError where the split has not kept what its plane sweep found, which the merge of
// `run` needs.
void RequireKnownSweep(const std::filesystem::path& blocks_path, const TrainingRun& run);

// Joins the blocks below `blocks_path`, and writes what TrainAndWrite writes. There must be no
// UnpolishedBlocks. Where the split is not polished by block, trains the end of the run; else reads
// no photo, and the log says of the part after the split no more than its end. Throws as
// RequireTrained and RequireKnownSweep, and as TrainAndWrite.
Model MergeBlocks(const std::filesystem::path& blocks_path,
                  TrainingFolder* folder,
                  TrainingRun* run);

}  // namespace semfoam
