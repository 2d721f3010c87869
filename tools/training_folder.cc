// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/training_folder.h"

#include "foam/device.h"
#include "foam/error.h"
#include "foam/number_text.h"
#include "foam/trainer.h"
#include "tools/exports.h"

#include <algorithm>
#include <cerrno>
#include <functional>
#include <system_error>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr char kExtension[] = ".ckpt";
constexpr char kTrained[] = "trained.ckpt";
constexpr char kReplaced[] = "replaced";
constexpr size_t kKept = 2;

// Options whose names say most come first: a preset changes many others.
std::vector<std::string> NamesOf(const std::map<std::string, std::string>& options) {
  std::vector<std::string> names;
  names.reserve(options.size());
  for (const auto& [name, value] : options) names.push_back(name);
  std::stable_partition(names.begin(), names.end(), [](const std::string& name) {
    return name.find('.') == std::string::npos;
  });
  return names;
}

}  // namespace

void AddCheckpointOptions(OptionManager* options, CheckpointOptions* checkpoints) {
  options->AddDefaultOption("checkpoint_every",
                            &checkpoints->every,
                            "seconds between checkpoints; 0 = only when the run is stopped");
  options->AddDefaultOption(
      "resume", &checkpoints->resume, "goes on from the newest checkpoint in the output folder");
}

TrainingFolder::TrainingFolder(const fs::path& output_path,
                               const CheckpointOptions& options,
                               const OptionManager& command)
    : output_path_(output_path),
      folder_(output_path / "checkpoints"),
      options_([&] {
        if (!(options.every >= 0)) {
          throw UserError("Failed to parse options - --checkpoint_every is ",
                          options.every,
                          "; it must be a number of seconds, or 0 for none while training.");
        }
        return options;
      }()),
      resume_command_(command.CommandLineWith(program_invocation_name, "resume", "1")),
      lock_(output_path) {}

bool TrainingFolder::IsFinished() const {
  if (!options_.resume || fs::exists(folder_) || !fs::exists(output_path_ / "scene.foam") ||
      !fs::exists(output_path_ / "labels.json")) {
    return false;
  }
  LOG(INFO) << output_path_.string()
            << " is finished: there is a scene.foam and no checkpoint. Without --resume it is "
               "trained anew.";
  return true;
}

fs::path TrainingFolder::PathOf(int64_t iteration) const {
  return folder_ / (std::to_string(iteration) + kExtension);
}

std::vector<int64_t> TrainingFolder::Iterations() const {
  std::vector<int64_t> iterations;
  std::error_code error;
  for (fs::directory_iterator entry(folder_, error), end; !error && entry != end;
       entry.increment(error)) {
    int64_t iteration = 0;
    if (entry->path().extension() == kExtension &&
        ParseNumber(entry->path().stem().string(), &iteration)) {
      iterations.push_back(iteration);
    }
  }
  std::sort(iterations.begin(), iterations.end(), std::greater<>());
  return iterations;
}

void TrainingFolder::RequireSameRun(const Checkpoint& checkpoint) const {
  const auto refuse = [&](const std::string& what) {
    throw UserError(checkpoint.path().string(),
                    ": this checkpoint is of a run with ",
                    what,
                    "; the same again, or --resume 0 to train from the beginning, would be right.");
  };
  const auto& options = identity_.at("options");
  const auto& saved_options = checkpoint.Texts("options");
  for (const std::string& name : NamesOf(options)) {
    const auto saved = saved_options.find(name);
    if (saved == saved_options.end()) refuse("no option --" + name);
    if (saved->second != options.at(name)) {
      refuse("--" + name + " " + saved->second + ", not " + options.at(name));
    }
  }
  const auto& saved_inputs = checkpoint.Texts("inputs");
  for (const auto& [name, checksum] : identity_.at("inputs")) {
    const auto saved = saved_inputs.find(name);
    if (saved == saved_inputs.end() || saved->second != checksum) {
      refuse(name == "model" ? "another COLMAP model" : "other " + name);
    }
  }
}

bool TrainingFolder::IsTrained() {
  const fs::path path = folder_ / kTrained;
  if (!options_.resume || !fs::exists(path)) return false;
  const Checkpoint checkpoint(path);
  RequireSameRun(checkpoint);
  const auto& result = checkpoint.Texts("result");
  const auto saved = result.find("scene.foam");
  const fs::path foam_path = output_path_ / "scene.foam";
  if (saved == result.end() || !fs::exists(foam_path) ||
      ModelChecksum(foam_path) != saved->second) {
    throw UserError(foam_path.string(),
                    ": is not the one that ",
                    path.string(),
                    " knows; that one, or --resume 0 to train from the beginning, would be right.");
  }
  LOG(INFO) << "Training is done already: going on with " << foam_path.string();
  say_.emplace([this] { SayStopped("after training"); });
  return true;
}

std::unique_ptr<Checkpoint> TrainingFolder::NewestCheckpoint() {
  if (!options_.resume) return nullptr;
  for (const int64_t iteration : Iterations()) {
    std::unique_ptr<Checkpoint> checkpoint;
    try {
      checkpoint = std::make_unique<Checkpoint>(PathOf(iteration));
    } catch (const UserError& error) {
      LOG(WARNING) << error.what();
      unreadable_.push_back(PathOf(iteration));
      continue;
    }
    RequireSameRun(*checkpoint);
    RequireSameDevice(*checkpoint, DeviceKindInUse());
    LOG(INFO) << "Going on from " << PathOf(iteration).string();
    return checkpoint;
  }
  LOG(INFO) << "There is no checkpoint to go on from in " << folder_.string()
            << ": training from the beginning.";
  return nullptr;
}

void TrainingFolder::Begin() try {
  for (const fs::path& path : unreadable_) fs::remove(path);
  fs::create_directories(folder_);
  if (!options_.resume) PutAside();
  last_ = std::chrono::steady_clock::now();
} catch (const fs::filesystem_error& error) {
  throw UserError(folder_.string(),
                  ": checkpoints cannot be kept there (",
                  error.code().message(),
                  "); choose an --output_path that you may write to.");
}

void TrainingFolder::PutAside() {
  if (fs::remove(folder_ / kTrained)) {
    LOG(WARNING) << output_path_.string()
                 << " holds a trained foam whose exports --resume 1 would have gone on with: this "
                    "run trains it anew.";
  }
  const std::vector<int64_t> left = Iterations();
  if (left.empty()) return;
  const fs::path replaced = folder_ / kReplaced;
  fs::remove_all(replaced);
  fs::create_directory(replaced);
  for (const int64_t iteration : left) {
    fs::rename(PathOf(iteration), replaced / PathOf(iteration).filename());
  }
  LOG(WARNING) << output_path_.string() << " holds a run that was stopped after iteration "
               << left.front()
               << " and that --resume 1 would have gone on with: this one trains from the "
                  "beginning, and the old checkpoints are in "
               << replaced.string() << " until it has finished.";
}

bool TrainingFolder::IsDue() const {
  const std::chrono::duration<double> since = std::chrono::steady_clock::now() - last_;
  return options_.every > 0 && since.count() >= options_.every;
}

void TrainingFolder::Write(int64_t iteration, CheckpointContents contents) {
  const auto begin = std::chrono::steady_clock::now();
  contents.texts.insert(identity_.begin(), identity_.end());
  try {
    WriteCheckpoint(PathOf(iteration), contents);
    std::vector<int64_t> iterations = Iterations();
    for (size_t i = kKept; i < iterations.size(); ++i) {
      std::error_code ignored;
      fs::remove(PathOf(iterations[i]), ignored);
    }
  } catch (const UserError& error) {
    LOG(WARNING) << error.what() << " There is no checkpoint of iteration " << iteration << ".";
  }
  // So that writing takes no more than half of the time, however slow the disk is.
  last_ = std::chrono::steady_clock::now();
  VLOG(1) << "Checkpoint " << PathOf(iteration).string() << " took "
          << std::chrono::duration<double>(last_ - begin).count() << " s";
}

void TrainingFolder::SayStopped(const std::string& where) const {
  LOG(WARNING) << "Stopped " << where << ". To go on from there: " << resume_command_;
}

void TrainingFolder::EndTraining() {
  CheckpointContents contents;
  contents.texts = identity_;
  contents.texts["result"]["scene.foam"] = ModelChecksum(output_path_ / "scene.foam");
  WriteCheckpoint(folder_ / kTrained, contents);
  say_.emplace([this] { SayStopped("after training"); });
  std::error_code ignored;
  for (const int64_t iteration : Iterations()) fs::remove(PathOf(iteration), ignored);
}

void TrainingFolder::Finish() {
  say_.reset();
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

}  // namespace semfoam
