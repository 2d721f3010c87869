// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/checkpoint.h"
#include "foam/interruption.h"
#include "tools/option_manager.h"
#include "tools/output_lock.h"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace semfoam {

struct CheckpointOptions {
  double every = 300;   // seconds between checkpoints; 0 = only when the run is stopped
  bool resume = false;  // go on from the newest checkpoint
};

// Adds --checkpoint_every and --resume.
void AddCheckpointOptions(OptionManager* options, CheckpointOptions* checkpoints);

// The output folder of a command that trains, from its beginning to its end. It is the only process
// that writes there (OutputLock). checkpoints/ is there from when training begins until all that
// the command writes has been written, so a folder without it is finished or was never begun:
//
//   <iteration>.ckpt   the two newest states of the training
//   trained.ckpt       instead of them: scene.foam is there, its exports may not be
//   replaced/          what a run left behind that a later one did not want to go on with
class TrainingFolder {
 public:
  // `command` is the one that trains, parsed. Throws UserError where `options` are out of range or
  // the folder cannot be had.
  TrainingFolder(const std::filesystem::path& output_path,
                 const CheckpointOptions& options,
                 const OptionManager& command);

  const std::filesystem::path& path() const { return output_path_; }
  bool resume() const { return options_.resume; }

  // With resume: whether there is nothing left to do, which is said.
  bool IsFinished() const;

  // What this run is made from: options and checksums of the inputs, in groups. A checkpoint has
  // them too. To be set before what follows.
  void SetIdentity(CheckpointTexts identity) { identity_ = std::move(identity); }

  // With resume: whether all of the training has been done, and scene.foam is its result. Throws
  // UserError where that was another run.
  bool IsTrained();

  // With resume: the newest checkpoint that can be read; those that cannot are told. Nothing where
  // there is none, which is said. Throws UserError, naming what differs, where it is of another
  // run, or of another kind of device than the one in use.
  std::unique_ptr<Checkpoint> NewestCheckpoint();

  // Training begins. Checkpoints that could not be read are removed; without resume, an earlier
  // run's are put aside, which is said. Throws UserError where that is not possible.
  void Begin();
  // Whether it is time for a checkpoint.
  bool IsDue() const;
  // Writes one, with the identity, and removes all but the two newest. Where it cannot be written,
  // warns: training goes on, and the older ones stay.
  void Write(int64_t iteration, CheckpointContents contents);
  // Says that the run was stopped "after training", and how to go on.
  void SayStopped(const std::string& where) const;
  // scene.foam has been written. From now on, or when it IsTrained, a signal that ends the process
  // says how to go on with what is left to be written.
  void EndTraining();
  // All has been written.
  void Finish();

 private:
  // Throws UserError where the checkpoint is of another run.
  void RequireSameRun(const Checkpoint& checkpoint) const;
  void PutAside();
  // Iterations of the checkpoints that are there, the newest first.
  std::vector<int64_t> Iterations() const;
  std::filesystem::path PathOf(int64_t iteration) const;

  const std::filesystem::path output_path_;
  const std::filesystem::path folder_;  // checkpoints/
  const CheckpointOptions options_;
  const std::string resume_command_;  // to be pasted into a shell
  const OutputLock lock_;
  CheckpointTexts identity_;
  std::vector<std::filesystem::path> unreadable_;
  std::optional<SayOnInterruption> say_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace semfoam
