// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/options/block_options.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/number_text.h"

#include <filesystem>

namespace semfoam {
namespace {

// Without --coarse_sites: foams of more sites are split while they have one in so many. Smaller
// ones lose some quality by that, and have no need of it.
constexpr int kLargestFineSplit = 200'000;
constexpr int kSitesOfCoarse = 8;
// Without --coarse_share.
constexpr double kShareOfFine = 0.3, kShareOfCoarse = 0.1;

// Chooses what the options leave open of the foam that is split.
void ChooseCoarseness(const TrainingOptions& training, BlockRunOptions* run) {
  SplitOptions& split = run->split;
  split.coarse_sites = run->coarse_sites;
  if (split.coarse_sites == -1) {
    const bool is_large = training.final_sites > kLargestFineSplit && training.late_rays == 0;
    split.coarse_sites = is_large ? training.final_sites / kSitesOfCoarse : 0;
  }
  split.coarse_share = run->coarse_share;
  if (split.coarse_share == 0) {
    split.coarse_share = split.coarse_sites > 0 ? kShareOfCoarse : kShareOfFine;
  }
}

}  // namespace

void AddBlockRunOptions(OptionManager* options, BlockRunOptions* run) {
  options->AddRequiredOption(
      "workspace_path", &run->workspace_path, "folder with images/, sparse/ and object_mask/");
  options->AddDefaultOption(
      "image_path", &run->training.image_path, "folder of the photos; by default images/");
  options->AddDefaultOption("input_path",
                            &run->training.input_path,
                            "the COLMAP model; by default sparse/0/, then sparse/");
  options->AddDefaultOption("blocks",
                            &run->blocks,
                            "number of blocks along the two axes along which the scene is widest, "
                            "3x2; this or --max_sites");
  options->AddDefaultOption("max_sites",
                            &run->split.max_sites,
                            "as many blocks as it takes for the training of each, with what it "
                            "sees around it, to have no more sites than this; 0 = --blocks");
  options->AddDefaultOption(
      "coarse_sites",
      &run->coarse_sites,
      "sites of the foam that is split, to which blocks add theirs: less "
      "memory for split and blocks; 0 = as many as the run has by then, most "
      "of final_sites; -1 = 0 up to 200000 final_sites, and an eighth of more");
  options->AddDefaultOption("coarse_share",
                            &run->coarse_share,
                            "share of the run that is trained before the split; 0 = 0.1 where "
                            "--coarse_sites are trained, 0.3 else");
  options->AddDefaultOption("polish_share",
                            &run->split.polish_share,
                            "share of the run, its end, in which the seams between the blocks "
                            "close");
  options->AddDefaultOption("polish_by_block",
                            &run->polish_by_block,
                            "1 = train that share block by block, each with its neighbours' sites "
                            "around it, in the memory of a block; 0 = on all sites together, in "
                            "foam_merger; -1 = 1 where --coarse_sites are trained, unless labels "
                            "of few masks are to be spread over the foam");
  AddTrainingRunOptions(options, &run->training);
}

void FinishBlockRun(const OptionManager& options, BlockRunOptions* run) {
  SplitOptions& split = run->split;
  if (run->blocks.empty() == (split.max_sites == 0)) {
    throw UserError(
        "Failed to parse options - --blocks and --max_sites both say how many blocks there are; "
        "one of them is required.");
  }
  if (const size_t x = run->blocks.find('x');
      !run->blocks.empty() &&
      (x == std::string::npos || !ParseNumber(run->blocks.substr(0, x), &split.columns) ||
       !ParseNumber(run->blocks.substr(x + 1), &split.rows))) {
    throw UserError("Failed to parse options - the argument ('",
                    Shortened(run->blocks),
                    "') for option '--blocks' is invalid; it takes two numbers, such as 3x2.");
  }
  if (run->polish_by_block < -1 || run->polish_by_block > 1) {
    throw FieldError("polish_by_block", " is ", run->polish_by_block, "; it must be 0, 1 or -1.");
  }
  if (run->polish_by_block != -1) split.polishes_blocks = run->polish_by_block == 1;
  FinishTrainingRun(options, run->workspace_path, &run->training);
  ChooseCoarseness(run->training.run.training, run);
  RequireValid(split);
  RequireSplittable(split, run->training.run);
}

std::filesystem::path ProjectPath(const std::filesystem::path& blocks_path) {
  return blocks_path / "project.ini";
}

TrainingRun ReadBlockRun(const std::filesystem::path& blocks_path) {
  BlockRunOptions run;
  if (!std::filesystem::exists(ProjectPath(blocks_path))) {
    throw UserError(blocks_path.string(),
                    ": is no split of a run, for it has no project.ini; a folder that "
                    "scene_splitter has written would be right.");
  }
  OptionManager options("scene_splitter", "");
  AddBlockRunOptions(&options, &run);
  options.ReadProject(ProjectPath(blocks_path).string());
  FinishBlockRun(options, &run);
  return run.training.run;
}

}  // namespace semfoam
