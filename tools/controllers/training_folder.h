// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/checkpoint.h"
#include "foam/util/device_kind.h"
#include "foam/util/interruption.h"
#include "tools/support/output_lock.h"

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
  double every = 300;      // seconds between checkpoints; 0 = only when the run is stopped
  bool resume = false;     // go on from the newest checkpoint
  bool overwrite = false;  // replace the foam that the folder holds, and its exports
};

// The output folder of a command that trains, from its beginning to its end. It is the only process
// that writes there (OutputLock). checkpoints/ is there from when training begins until all that
// the command writes has been written, so a folder without it is finished or was never begun:
//
//   <iteration>.ckpt   the two newest states of the training
//   trained.ckpt       instead of them: scene.foam is there, its exports may not be
//   replaced/          checkpoints of a run that a later one did not want to go on with; those of a
//                      second such run are in replaced_2/, and so on
//   damaged/           checkpoints that are not whole
class TrainingFolder {
 public:
  // `resume_command` is what a log line tells a user to run to go on with a run that was stopped.
  // Throws UserError where `options` are out of range or the folder cannot be had.
  TrainingFolder(const std::filesystem::path& output_path,
                 const CheckpointOptions& options,
                 const std::string& resume_command);

  const std::filesystem::path& path() const { return output_path_; }
  bool resume() const { return options_.resume; }

  // With resume: whether there is nothing left to do, which is said.
  bool IsFinished() const;

  // Throws UserError, naming the file, where the folder holds a trained foam, or exports, that this
  // run would replace without having been told to (CheckpointOptions::overwrite), or a labels.json
  // that no export wrote (ReadExportRecord). To be called before anything is read.
  void RequireReplaceable() const;

  // What this run is made from: options and checksums of the inputs, in groups. A checkpoint has
  // them too. To be set before what follows.
  void SetIdentity(CheckpointTexts identity) { identity_ = std::move(identity); }

  // With resume: whether all of the training has been done, and scene.foam is its result. Throws
  // UserError where that was another run, or as NewestCheckpoint().
  bool IsTrained();

  // With resume: the newest checkpoint that is whole; warns of those that are not. Nothing where
  // there is none, which is said. Throws UserError, and has changed nothing, where one is of
  // another version of the format or cannot be read, where it is of another run (naming what
  // differs) or of another kind than `device`, and where without a checkpoint a trained foam would
  // be replaced (RequireReplaceable).
  std::unique_ptr<Checkpoint> NewestCheckpoint(DeviceKind device);

  // Training begins. Checkpoints that are not whole are moved into damaged/; without resume, an
  // earlier run's are put aside. Warns of both. Throws UserError where that is not possible.
  void Begin();
  // Whether it is time for a checkpoint.
  bool IsDue() const;
  // Writes one, with the identity, and removes all but the two newest. Where it cannot be written,
  // warns: training goes on, and the older ones stay.
  void Write(int64_t iteration, CheckpointContents contents);
  // Logs that the run was stopped after this iteration, and the command that resumes it from there
  // or from an older checkpoint; or that there is no checkpoint to resume from.
  void LogHowToResume(int64_t iteration) const;
  // Logs that the run was stopped after the training, and the command that resumes it.
  void LogHowToResumeAfterTraining() const;
  // Removes a file of a training that this one does not write, where it is of the foam that this
  // one has replaced, and says so.
  void RemoveReplaced(const std::string& file) const;
  // scene.foam has been written. From now on, or when it IsTrained, a signal that ends the process
  // says how to go on with what is left to be written.
  void EndTraining();
  // All has been written: removes checkpoints/, and says so of what an earlier run left there.
  // Files in it that no run of this program wrote stay, with a warning.
  void Finish();

 private:
  // The checkpoint at `path`; nothing, with a warning, where it is not whole. Throws UserError
  // where it says nothing about what it holds (foam/train/checkpoint.h).
  std::unique_ptr<Checkpoint> Read(const std::filesystem::path& path);
  // Throws UserError where the checkpoint is of another run.
  void RequireSameRun(const Checkpoint& checkpoint) const;
  void PutAside() const;
  void MoveDamaged() const;
  // Iterations of the checkpoints that are there, the newest first. Throws filesystem_error where
  // the folder cannot be listed.
  std::vector<int64_t> Iterations() const;
  std::filesystem::path PathOf(int64_t iteration) const;

  const std::filesystem::path output_path_;
  const std::filesystem::path folder_;  // checkpoints/
  const CheckpointOptions options_;
  const std::string resume_command_;  // to be pasted into a shell
  const OutputLock lock_;
  CheckpointTexts identity_;
  std::vector<std::filesystem::path> damaged_;  // found by this run
  bool replaces_foam_ = false;                  // there was a scene.foam when training began
  std::optional<OnInterrupt> log_how_to_resume_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace semfoam
