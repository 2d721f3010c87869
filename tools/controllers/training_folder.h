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

// Options of checkpoints and of the output folder.
struct CheckpointOptions {
  // Seconds between checkpoints; 0: only when the run is stopped.
  double every = 300;
  // Seconds between previews of the training (TrainingPreviews); 0: none.
  double preview_every = 0;
  // Whether to resume from the newest checkpoint.
  bool resume = false;
  // Whether to replace the foam in the folder, and its exports.
  bool overwrite = false;
};

// Manages the output folder of a command that trains. Locks it, so that no other process writes
// there (OutputLock). checkpoints/ exists from the beginning of the training until the command has
// written all its files, so a folder without it is finished or was never begun:
//
//   <iteration>.ckpt   the two newest states of the training
//   trained.ckpt       instead of them: scene.foam is written, its exports may not be complete
//   replaced/          checkpoints of a run that a later one has not resumed; those of a second
//   such
//                      run are in replaced_2/, and so on
//   damaged/           incomplete checkpoints
class TrainingFolder {
 public:
  // `resume_command` is the shell command that log lines give for resuming a stopped run. Where
  // `writes` is false, another process writes there, and this one only asks for path() and calls
  // SetIdentity and CheckpointAt. Throws UserError where `options` are out of range or the folder
  // cannot be created or locked.
  TrainingFolder(const std::filesystem::path& output_path,
                 const CheckpointOptions& options,
                 const std::string& resume_command,
                 bool writes = true);

  const std::filesystem::path& path() const { return output_path_; }
  bool resume() const { return options_.resume; }
  double preview_every() const { return options_.preview_every; }

  // Returns whether the run is to be resumed and is finished already, and logs that.
  bool IsFinished() const;

  // Throws UserError, naming the file, where the folder holds a trained foam or exports that this
  // run would replace without CheckpointOptions::overwrite, or a labels.json that no export wrote
  // (ReadExportRecord). Must be called before anything is read.
  void RequireReplaceable() const;

  // Sets the identity of this run: options and checksums of the inputs, in groups. Checkpoints
  // store it. Must be called before the functions below.
  void SetIdentity(CheckpointTexts identity) { identity_ = std::move(identity); }

  // Returns whether the run is to be resumed, its training is complete, and scene.foam is the
  // result. Throws UserError where scene.foam or the checkpoint is of another run, and as
  // NewestCheckpoint() does.
  bool IsTrained();

  // Returns, for a run to be resumed, the newest checkpoint that is complete; warns about
  // incomplete ones. Returns null if there is none, and logs that. Throws UserError, without having
  // changed anything, where a checkpoint has another version of the format or cannot be read, is of
  // another run (naming the difference) or of another kind of device than `device`, and where
  // without a checkpoint a trained foam would be replaced (RequireReplaceable).
  std::unique_ptr<Checkpoint> NewestCheckpoint(DeviceKind device);

  // Returns the checkpoint in this file. Throws as NewestCheckpoint does, and where it is not
  // complete.
  std::unique_ptr<Checkpoint> CheckpointAt(const std::filesystem::path& path,
                                           DeviceKind device) const;

  // Adds the identity to a checkpoint's contents.
  void AddIdentity(CheckpointContents* contents) const {
    contents->texts.insert(identity_.begin(), identity_.end());
  }

  // Begins the training. Moves incomplete checkpoints into damaged/ and, without resume, those of
  // an earlier run into replaced/, with warnings. Throws UserError where that is not possible.
  void Begin();
  // Returns whether it is time for a checkpoint.
  bool IsDue() const;
  // Writes a checkpoint with the identity, and removes all but the two newest. If it cannot be
  // written, only warns, and keeps the older ones.
  void Write(int64_t iteration, CheckpointContents contents);
  // Logs that the run was stopped after this iteration, and the command that resumes it from there
  // or from an older checkpoint; or that there is no checkpoint to resume from.
  void LogHowToResume(int64_t iteration) const;
  // Logs that the run was stopped after the training, and the command that resumes it.
  void LogHowToResumeAfterTraining() const;
  // Removes `file`, which only some trainings write, if it belongs to the foam that this run has
  // replaced, with a warning.
  void RemoveReplaced(const std::string& file) const;
  // Ends the training, after scene.foam was written: replaces the checkpoints by trained.ckpt.
  // After this, or after IsTrained() has returned true, a signal that ends the process logs the
  // command that resumes the exports.
  void EndTraining();
  // Ends the run, after all files were written: removes checkpoints/, and logs the removal of an
  // earlier run's checkpoints. Keeps files in it that no run of this program wrote, with a warning.
  void Finish();

 private:
  // Reads the checkpoint at `path`; returns null, with a warning, where it is incomplete. Throws
  // UserError where its contents are unknown (foam/train/checkpoint.h).
  std::unique_ptr<Checkpoint> Read(const std::filesystem::path& path);
  // Throws UserError where the checkpoint is of another run.
  void RequireSameRun(const Checkpoint& checkpoint) const;
  void PutAside() const;
  void MoveDamaged() const;
  // Returns the iterations of the existing checkpoints, the newest first. Throws filesystem_error
  // where the folder cannot be listed.
  std::vector<int64_t> Iterations() const;
  std::filesystem::path PathOf(int64_t iteration) const;

  const std::filesystem::path output_path_;
  // The folder checkpoints/.
  const std::filesystem::path folder_;
  const CheckpointOptions options_;
  const std::string resume_command_;
  // Nothing where another process writes.
  std::optional<OutputLock> lock_;
  CheckpointTexts identity_;
  // Incomplete checkpoints that this run has found.
  std::vector<std::filesystem::path> damaged_;
  // Whether there was a scene.foam when the training began.
  bool replaces_foam_ = false;
  // Logs the resume command when a signal ends the process after the training.
  std::optional<OnInterrupt> log_how_to_resume_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

// Returns whether a training was begun in this output folder and has not ended.
bool HoldsStoppedTraining(const std::filesystem::path& output_path);

}  // namespace semfoam
