// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/memory_plan.h"
#include "foam/util/error.h"
#include "foam/util/output_file.h"
#include "tools/commands/commands.h"
#include "tools/controllers/block_run.h"
#include "tools/options/block_options.h"
#include "tools/support/value_text.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// The commands that train the blocks, and those that train their parts of the end of the run. The
// latter may run when the former are done; foam_merger runs what is left of them.
constexpr char kJobs[] = "jobs.txt";
constexpr char kPolishJobs[] = "polish_jobs.txt";

// Returns such commands, one a line.
std::string JobsText(const fs::path& blocks_path,
                     const BlocksRecord& record,
                     const std::string& more) {
  const fs::path folder = fs::absolute(blocks_path).lexically_normal();
  std::string jobs;
  for (const BlockRecord& block : record.blocks) {
    jobs += "semfoam foam_trainer --block_path " + ShellQuoted((folder / block.name).string()) +
            more + "\n";
  }
  return jobs;
}

// Runs the jobs and the merge with GNU parallel.
constexpr char kParallelScript[] =
    R"sh(#!/bin/sh
# Trains the blocks, JOBS (1) at a time, and makes one foam of them.
# usage: [JOBS=2] run_parallel.sh [OUTPUT_FOLDER]
set -e
blocks=$(cd "$(dirname "$0")" && pwd)
for jobs in jobs.txt polish_jobs.txt; do
  test ! -f "$blocks/$jobs" ||
    parallel --jobs "${JOBS:-1}" --halt soon,fail=1 < "$blocks/$jobs"
done
exec semfoam foam_merger --blocks_path "$blocks" --output_path "${1:-$blocks/merged}"
)sh";

// Returns a script that gives the jobs and the merge to Slurm.
std::string SlurmScript(const BlocksRecord& record) {
  int64_t memory = 0;
  for (const BlockRecord& block : record.blocks) memory = std::max(memory, block.memory_bytes);
  const std::string megabytes = std::to_string(memory / 1'000'000 + 1);
  return R"sh(#!/bin/sh
# Gives the blocks to Slurm as an array job, their polishing, if they are polished one by one, as a
# second one that waits for all of them, and the merge as a job that waits for that. A job that is requeued goes on from its checkpoint. MEMORY (megabytes) is that of the largest block,
# without its photos.
# usage: [CPUS=2] [MEMORY=)sh" +
         megabytes + R"sh(] [SBATCH_OPTIONS=...] run_slurm.sh [OUTPUT_FOLDER]
set -e
blocks=$(cd "$(dirname "$0")" && pwd)
export SEMFOAM_OUTPUT=$(realpath -m "${1:-$blocks/merged}")
# usage: give_array JOB_NAME JOBS_FILE LOGS [OPTION]
give_array() {
  sbatch --parsable --requeue --job-name="$1" --array=1-)sh" +
         std::to_string(record.blocks.size()) + R"sh( \
    --cpus-per-task="${CPUS:-2}" --mem="${MEMORY:-)sh" +
         megabytes + R"sh(}M" --chdir="$blocks" --output="$3_%a.log" ${SBATCH_OPTIONS:-} $4 \
    --wrap='sh -c "$(sed -n "${SLURM_ARRAY_TASK_ID}p" '"$2"')"'
}
array=$(give_array semfoam_blocks jobs.txt block)
if test -f "$blocks/polish_jobs.txt"; then
  array=$(give_array semfoam_polish polish_jobs.txt polish "--dependency=afterok:$array")
fi
sbatch --parsable --requeue --job-name=semfoam_merger --dependency="afterok:$array" \
  --cpus-per-task="${CPUS:-2}" --mem="${MERGE_MEMORY:-0}" --chdir="$blocks" --output=merge.log \
  ${SBATCH_OPTIONS:-} \
  --wrap='semfoam foam_merger --blocks_path . --output_path "$SEMFOAM_OUTPUT" --resume 1'
)sh";
}

// Writes a script that may be run.
void WriteScript(const fs::path& path, const std::string& text) {
  WriteTextFile(path, text);
  fs::permissions(path,
                  fs::perms::owner_exec | fs::perms::group_exec | fs::perms::others_exec,
                  fs::perm_options::add);
}

// Writes the commands of the blocks and the scripts that run them.
void WriteJobs(const fs::path& blocks_path, const BlocksRecord& record) {
  WriteTextFile(blocks_path / kJobs, JobsText(blocks_path, record, ""));
  if (record.polishes_blocks) {
    WriteTextFile(blocks_path / kPolishJobs, JobsText(blocks_path, record, " --polish 1"));
  }
  WriteScript(blocks_path / "run_parallel.sh", kParallelScript);
  WriteScript(blocks_path / "run_slurm.sh", SlurmScript(record));
}

void LogBlocks(const fs::path& blocks_path, const BlocksRecord& record) {
  for (const BlockRecord& block : record.blocks) {
    LOG(INFO) << "Block " << block.name << ": about " << block.own_sites << " sites of its own, up "
              << "to " << block.sites << " in its training, " << block.photos.size() << " photos, "
              << std::lround(100 * block.ray_share) << " % of the rays, "
              << FormatBytes(block.memory_bytes) << " of memory, about "
              << std::lround(block.seconds) << " s";
  }
  LOG(INFO) << "Each line of " << (blocks_path / kJobs).string()
            << " trains one block, in any order; "
            << (record.polishes_blocks
                    ? "when all are trained, each line of " + (blocks_path / kPolishJobs).string() +
                          " may polish one; "
                    : "")
            << "then: semfoam foam_merger --blocks_path " << ShellQuoted(blocks_path.string())
            << " --output_path OUT";
}

}  // namespace

void RunSceneSplitter(int argc, char** argv) {
  std::string output_path;
  BlockRunOptions run;
  CheckpointOptions checkpoints;
  OptionManager options("scene_splitter",
                        "Trains the beginning of a foam and cuts it into blocks of space, each of "
                        "which is trained by a command of its own, on any machine; foam_merger "
                        "makes one foam of them.");
  options.AddRequiredOption(
      "output_path", &output_path, "folder for blocks.json, jobs.txt and a folder for each block");
  AddBlockRunOptions(&options, &run);
  AddCheckpointOptions(&options, &checkpoints);
  options.SetFrequentOptions({"workspace_path",
                              "blocks",
                              "max_sites",
                              "quality",
                              "FoamTraining.num_rays",
                              "FoamTraining.final_sites",
                              "test_every",
                              "resume",
                              "progress",
                              "num_threads"});
  if (!options.Parse(argc, argv)) return;
  FinishBlockRun(options, &run);
  RequireSeedCloudIsKept(run.training, output_path);

  const fs::path record_path = fs::path(output_path) / "blocks.json";
  if (fs::exists(record_path) && !checkpoints.overwrite) {
    if (!checkpoints.resume) {
      throw UserError(record_path.string(),
                      ": holds a split; ",
                      Field{"overwrite"},
                      " 1 to replace it and its blocks, or another ",
                      Field{"output_path"},
                      ", would be right.");
    }
    // A run that was killed after it wrote the record may lack what follows.
    WriteJobs(output_path, ReadBlocksRecord(output_path));
    TrainingFolder(output_path, checkpoints, ResumeCommand(options)).Finish();
    LOG(INFO) << output_path << " is split already.";
    return;
  }
  TrainingFolder folder(output_path, checkpoints, ResumeCommand(options));
  folder.RequireReplaceable();
  if (fs::exists(record_path)) {
    for (const BlockRecord& block : ReadBlocksRecord(folder.path()).blocks) {
      fs::remove_all(folder.path() / block.name);
    }
    fs::remove(record_path);
    fs::remove(folder.path() / kPolishJobs);
  }
  WriteTextFile(
      ProjectPath(folder.path()),
      options.ProjectText(
          {"output_path", "checkpoint_every", "preview_every", "resume", "overwrite", "device"}));
  const BlocksRecord record = SplitRun(run.split, &folder, &run.training.run);
  WriteJobs(folder.path(), record);
  folder.Finish();
  LogBlocks(folder.path(), record);
}

}  // namespace semfoam
