// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/solid_ground.h"
#include "foam/model/foam.h"
#include "foam/optim/optimizer.h"
#include "foam/train/checkpoint.h"
#include "foam/train/drawn_squares.h"
#include "foam/train/space_blocks.h"
#include "foam/train/training_options.h"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

// Splits the checkpoint of a training into those of blocks, and joins the blocks' results to a
// checkpoint again. So a block is a training that goes on, with the schedule of the whole, and the
// joined blocks are one too. The parts of a checkpoint that belong to no site (classifier, losses,
// reports) are those of the run that was split.

namespace semfoam {

// Contents of a checkpoint that hold some arrays of their own.
struct OwnedContents {
  CheckpointContents contents;
  std::deque<std::vector<std::byte>> bytes;
};

// Returns the foam and the densification statistics of a checkpoint of any run. Throws
// DamagedCheckpoint where it does not hold them.
Foam FoamOf(const Checkpoint& checkpoint);
DensificationStatistics StatisticsOf(const Checkpoint& checkpoint);

// Returns the number of iterations done.
int64_t IterationOf(const Checkpoint& checkpoint);
// Returns whether the checkpoint can be split: its SH degree is final, and no triangulation is
// pending.
bool CanBeSplit(const CheckpointContents& contents);

// The part of a run that one block trains.
struct BlockTraining {
  BlockBox box;
  float halo = 0;
  BlockRays rays;
  // The seeds of the run, which determine the space that stays empty (FreeSpace).
  std::vector<SeedPoint> seeds;
  // The options of the run, but for the numbers of the block's sites.
  TrainingOptions options;
  // Whether the foam that was split is coarser than that of the run: then the block begins with
  // sites of its own at the seeds besides, and its densification begins anew.
  bool refines = false;
};

// Returns the options of a block of a run with `options`: its densification ends with `block_sites`
// sites, and the classifier, which is common to all blocks, stays.
TrainingOptions OptionsOfBlock(const TrainingOptions& options, int64_t block_sites);

// Returns the options of the beginning of a run, of which `share` is trained before it is split
// into blocks that refine: densification ends with `coarse_sites` sites, and early enough for their
// errors to tell where the blocks' sites belong.
TrainingOptions OptionsOfCoarse(const TrainingOptions& options, int coarse_sites, double share);

// Returns the options of a block that refines a coarse foam: its densification begins anew at
// `begin` and takes as long as that of the run, or half of the time until `end`, whichever is less.
// Both are fractions of the run. TrainingOptions::late_rays must be 0.
TrainingOptions WithDensificationBetween(TrainingOptions options, double begin, double end);

// Replaces the values of `options` by those of the checkpoint.
void ReadOptions(const Checkpoint& checkpoint, TrainingOptions* options);

// Returns the checkpoint from which a block begins. Borrows arrays of `split`. Sites outside of
// block and halo are frozen, and those of them that no ray of the block meets are left out. A block
// that refines gets sites at seeds in block and halo (AddSitesAtSeeds) until 0.65 of the sites that
// it will train are there; of the site nearest to it a new one has the identity, the ancestor and
// the density, if that is greater than that of a seed.
OwnedContents BlockStart(const Checkpoint& split, const TrainingViews& views, BlockTraining block);

// Returns whether SeedsOf and GroundOf read this array of a block's start.
bool IsOfRun(const std::string& array);
// Returns the seeds of the run, for TrainFoam, of a block's start. Their colours are not kept.
std::vector<SeedPoint> SeedsOf(const Checkpoint& start);
// Returns what things stand on in the run (TrainingViews::Ground), of a block's start.
std::optional<SolidGround> GroundOf(const Checkpoint& start);

// Returns the result of a block: of a checkpoint of its run, the sites in its box. Borrows arrays
// of `trained`; `begin` is the iteration at which the space was split.
OwnedContents BlockResult(const CheckpointContents& trained, const BlockBox& box, int64_t begin);

// Reads the result of a block, by its number.
using ReadBlock = std::function<std::unique_ptr<const Checkpoint>(size_t block)>;

// Returns the checkpoint from which the block `own` trains the end of the run: the sites that the
// results of `blocks` have in `padded`, its box with the halo, and around these the frozen ones of
// `start`, with which the block began. `blocks` must be all whose boxes meet `padded`, `own` among
// them, ascending. One result at a time is in memory. Borrows nothing. Throws DamagedCheckpoint
// where they do not belong to one run.
OwnedContents PolishStart(const Checkpoint& start,
                          const BlockBox& padded,
                          size_t own,
                          const std::vector<size_t>& blocks,
                          const ReadBlock& read);

// Returns the checkpoint of the whole run that the results of all blocks make, in the order of the
// sites that they were when the space was split. Borrows arrays of `split`. Throws
// DamagedCheckpoint where a block does not belong to it.
OwnedContents JoinBlocks(const Checkpoint& split, const std::vector<const Checkpoint*>& blocks);

// Return the sites of a block's result, in the order that JoinBlocks gives to them among
// themselves: [N] the positions alone; or a foam of degree 0, without gradients of colour, and of
// the classifier only the number of classes, as the weights are the run's. Throw DamagedCheckpoint
// where the checkpoint does not hold them.
std::vector<Eigen::Vector3f> SitesOfBlock(const Checkpoint& block);
Foam FoamOfBlock(const Checkpoint& block);
// Return the names of the arrays that these read: a twentieth, and a tenth, of the result's bytes.
std::set<std::string> ArraysOfSites();
std::set<std::string> ArraysOfFoam();

}  // namespace semfoam
