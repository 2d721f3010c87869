// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/training_folder.h"

#include "foam/train/trainer.h"
#include "foam/util/error.h"
#include "foam/util/number_text.h"
#include "foam/util/scratch_folder.h"
#include "tools/controllers/export_record.h"

#include <algorithm>
#include <functional>
#include <system_error>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr char kCheckpoints[] = "checkpoints";
constexpr char kExtension[] = ".ckpt";
constexpr char kTrained[] = "trained.ckpt";
constexpr char kReplaced[] = "replaced";
constexpr char kDamaged[] = "damaged";
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

// `path` itself for number 1, then path_2, path_3 ..., before its extension.
fs::path Numbered(const fs::path& path, int number) {
  if (number == 1) return path;
  fs::path numbered = path.parent_path() / path.stem();
  numbered += "_";
  numbered += std::to_string(number);
  numbered += path.extension();
  return numbered;
}

// Returns the first of these that does not exist.
fs::path Unused(const fs::path& path) {
  int number = 1;
  while (fs::exists(fs::symlink_status(Numbered(path, number)))) ++number;
  return Numbered(path, number);
}

}  // namespace

TrainingFolder::TrainingFolder(const fs::path& output_path,
                               const CheckpointOptions& options,
                               const std::string& resume_command,
                               bool writes)
    : output_path_(output_path),
      folder_(output_path / kCheckpoints),
      options_([&] {
        if (!(options.every >= 0)) {
          throw FieldError("checkpoint_every",
                           " is ",
                           options.every,
                           "; it must be a number of seconds, or 0 for none while training.");
        }
        if (!(options.preview_every >= 0)) {
          throw FieldError("preview_every",
                           " is ",
                           options.preview_every,
                           "; it must be a number of seconds, or 0 for none.");
        }
        return options;
      }()),
      resume_command_(resume_command) {
  if (writes) lock_.emplace(output_path);
}

bool TrainingFolder::IsFinished() const {
  if (!options_.resume || fs::exists(folder_) || !fs::exists(output_path_ / "scene.foam") ||
      !fs::exists(output_path_ / "labels.json")) {
    return false;
  }
  LOG(INFO) << output_path_.string()
            << " is finished: there is a scene.foam and no checkpoint; overwrite 1 without resume "
               "trains it anew.";
  return true;
}

void TrainingFolder::RequireReplaceable() const {
  const std::optional<ExportRecord> record = ReadExportRecord(output_path_);
  const bool has_checkpoints = !Iterations().empty() || fs::exists(folder_ / kTrained);
  if (options_.overwrite || (options_.resume && has_checkpoints)) return;
  if (const fs::path foam_path = output_path_ / "scene.foam"; fs::exists(foam_path)) {
    if (has_checkpoints) {
      throw UserError(foam_path.string(),
                      ": holds a trained foam; ",
                      Field{"resume"},
                      " 1 to go on with the run that is not finished there, ",
                      Field{"overwrite"},
                      " 1 to replace it and its exports, or another ",
                      Field{"output_path"},
                      ", would be right.");
    }
    throw UserError(foam_path.string(),
                    ": holds a trained foam; ",
                    Field{"overwrite"},
                    " 1 to replace it and its exports, or another ",
                    Field{"output_path"},
                    ", would be right.");
  }
  if (!record || record->files.empty()) return;
  throw UserError((output_path_ / record->files.front().path).string(),
                  ": is of another foam, as labels.json there says; ",
                  Field{"overwrite"},
                  " 1 to replace all that it lists, or another ",
                  Field{"output_path"},
                  ", would be right.");
}

fs::path TrainingFolder::PathOf(int64_t iteration) const {
  return folder_ / (std::to_string(iteration) + kExtension);
}

std::vector<int64_t> TrainingFolder::Iterations() const {
  std::vector<int64_t> iterations;
  if (!fs::is_directory(folder_)) return iterations;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_)) {
    int64_t iteration = 0;
    if (ParseNumber(entry.path().stem().string(), &iteration) &&
        PathOf(iteration) == entry.path()) {
      iterations.push_back(iteration);
    }
  }
  std::sort(iterations.begin(), iterations.end(), std::greater<>());
  return iterations;
}

std::unique_ptr<Checkpoint> TrainingFolder::Read(const fs::path& path) try {
  return std::make_unique<Checkpoint>(path);
} catch (const DamagedCheckpoint& error) {
  LOG(WARNING) << error.what();
  damaged_.push_back(path);
  return nullptr;
}

void TrainingFolder::RequireSameRun(const Checkpoint& checkpoint) const {
  const auto refuse = [&](const std::string& what) {
    throw UserError(checkpoint.path().string(),
                    ": this checkpoint is of a run with ",
                    what,
                    "; the same again, or ",
                    Field{"resume"},
                    " 0 to train from the beginning, would be right.");
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
      refuse(name == "model"        ? "another COLMAP model"
             : name == "seed_cloud" ? "another dense point cloud"
                                    : "other " + name);
    }
  }
}

bool TrainingFolder::IsTrained() {
  const fs::path path = folder_ / kTrained;
  if (!options_.resume || !fs::exists(path)) return false;
  const std::unique_ptr<Checkpoint> checkpoint = Read(path);
  if (checkpoint == nullptr) return false;
  RequireSameRun(*checkpoint);
  const auto& result = checkpoint->Texts("result");
  const auto saved = result.find("scene.foam");
  const fs::path foam_path = output_path_ / "scene.foam";
  if (saved == result.end() || !fs::exists(foam_path) ||
      ModelChecksum(foam_path) != saved->second) {
    throw UserError(foam_path.string(),
                    ": is not the one that ",
                    path.string(),
                    " knows; that one, or ",
                    Field{"resume"},
                    " 0 ",
                    Field{"overwrite"},
                    " 1 to train from the beginning, "
                    "would be right.");
  }
  LOG(INFO) << "Training is done already: going on with " << foam_path.string();
  log_how_to_resume_.emplace([this] { LogHowToResumeAfterTraining(); });
  return true;
}

std::unique_ptr<Checkpoint> TrainingFolder::NewestCheckpoint(DeviceKind device) {
  if (!options_.resume) return nullptr;
  for (const int64_t iteration : Iterations()) {
    std::unique_ptr<Checkpoint> checkpoint = Read(PathOf(iteration));
    if (checkpoint == nullptr) continue;
    RequireSameRun(*checkpoint);
    RequireSameDevice(*checkpoint, device);
    LOG(INFO) << "Going on from " << PathOf(iteration).string();
    return checkpoint;
  }
  if (const fs::path foam_path = output_path_ / "scene.foam";
      !options_.overwrite && fs::exists(foam_path)) {
    throw UserError(foam_path.string(),
                    ": holds a trained foam, and there is no whole checkpoint to go on from in ",
                    folder_.string(),
                    "; export it, or train with ",
                    Field{"overwrite"},
                    " 1 "
                    "from the beginning.");
  }
  LOG(INFO) << "There is no checkpoint to go on from in " << folder_.string()
            << ": training from the beginning.";
  return nullptr;
}

std::unique_ptr<Checkpoint> TrainingFolder::CheckpointAt(const fs::path& path,
                                                         DeviceKind device) const {
  auto checkpoint = std::make_unique<Checkpoint>(path);
  RequireSameRun(*checkpoint);
  RequireSameDevice(*checkpoint, device);
  return checkpoint;
}

void TrainingFolder::Begin() try {
  replaces_foam_ = fs::exists(output_path_ / "scene.foam");
  fs::create_directories(folder_);
  MoveDamaged();
  if (!options_.resume) PutAside();
  last_ = std::chrono::steady_clock::now();
} catch (const fs::filesystem_error& error) {
  throw UserError(folder_.string(),
                  ": checkpoints cannot be kept there (",
                  error.code().message(),
                  "); choose an ",
                  Field{"output_path"},
                  " that you may write to.");
}

void TrainingFolder::MoveDamaged() const {
  for (const fs::path& path : damaged_) {
    fs::create_directory(folder_ / kDamaged);
    const fs::path moved = Unused(folder_ / kDamaged / path.filename());
    fs::rename(path, moved);
    LOG(WARNING) << path.string() << " is not whole: it is moved to " << moved.string()
                 << " until the run has finished.";
  }
}

void TrainingFolder::PutAside() const {
  const std::vector<int64_t> left = Iterations();
  const bool is_trained = fs::exists(folder_ / kTrained);
  if (left.empty() && !is_trained) return;
  const fs::path replaced = Unused(folder_ / kReplaced);
  fs::create_directory(replaced);
  for (const int64_t iteration : left) {
    fs::rename(PathOf(iteration), replaced / PathOf(iteration).filename());
  }
  if (is_trained) {
    fs::rename(folder_ / kTrained, replaced / kTrained);
    LOG(WARNING) << output_path_.string()
                 << " holds a trained foam whose exports resume 1 would have gone on with: this "
                    "run trains it anew.";
  } else {
    LOG(WARNING) << output_path_.string() << " holds a run that was stopped after iteration "
                 << left.front()
                 << " and that resume 1 would have gone on with: this one trains from the "
                    "beginning, and the old checkpoints are in "
                 << replaced.string() << " until it has finished.";
  }
}

bool TrainingFolder::IsDue() const {
  const std::chrono::duration<double> since = std::chrono::steady_clock::now() - last_;
  return options_.every > 0 && since.count() >= options_.every;
}

void TrainingFolder::Write(int64_t iteration, CheckpointContents contents) {
  const auto begin = std::chrono::steady_clock::now();
  AddIdentity(&contents);
  try {
    WriteCheckpoint(PathOf(iteration), contents);
    const std::vector<int64_t> iterations = Iterations();
    for (size_t i = kKept; i < iterations.size(); ++i) {
      std::error_code ignored;
      fs::remove(PathOf(iterations[i]), ignored);
    }
  } catch (const UserError& error) {
    LOG(WARNING) << error.what() << " There is no checkpoint of iteration " << iteration << ".";
  } catch (const fs::filesystem_error& error) {
    LOG(WARNING) << folder_.string() << ": older checkpoints cannot be looked for ("
                 << error.code().message() << "), so they stay.";
  }
  // So that writing takes no more than half of the time, however slow the disk is.
  last_ = std::chrono::steady_clock::now();
  VLOG(1) << "Checkpoint " << PathOf(iteration).string() << " took "
          << std::chrono::duration<double>(last_ - begin).count() << " s";
}

void TrainingFolder::LogHowToResume(int64_t iteration) const {
  std::vector<int64_t> iterations;
  try {
    iterations = Iterations();
  } catch (const fs::filesystem_error&) {
    // As if there were none: nothing can be read there.
  }
  const std::string stopped = "Stopped after iteration " + std::to_string(iteration) + ". ";
  if (iterations.empty()) {
    LOG(WARNING) << stopped << "No checkpoint could be written, so there is nothing to go on from.";
  } else if (iterations.front() == iteration) {
    LOG(WARNING) << stopped << "To go on from there: " << resume_command_;
  } else {
    LOG(WARNING) << stopped << "The newest checkpoint is of iteration " << iterations.front()
                 << "; to go on from it: " << resume_command_;
  }
}

void TrainingFolder::LogHowToResumeAfterTraining() const {
  LOG(WARNING) << "Stopped after training. To go on from there: " << resume_command_;
}

void TrainingFolder::EndTraining() {
  CheckpointContents contents;
  contents.texts = identity_;
  contents.texts["result"]["scene.foam"] = ModelChecksum(output_path_ / "scene.foam");
  WriteCheckpoint(folder_ / kTrained, contents);
  log_how_to_resume_.emplace([this] { LogHowToResumeAfterTraining(); });
  std::error_code ignored;
  for (const int64_t iteration : Iterations()) fs::remove(PathOf(iteration), ignored);
}

void TrainingFolder::RemoveReplaced(const std::string& file) const {
  std::error_code error;
  if (!replaces_foam_ || !fs::remove(output_path_ / file, error)) return;
  LOG(WARNING) << "Removed " << (output_path_ / file).string()
               << ": it is of the foam that was here before.";
}

void TrainingFolder::Finish() {
  log_how_to_resume_.reset();
  std::error_code error;
  for (const int64_t iteration : Iterations()) fs::remove(PathOf(iteration), error);
  for (const char* name : {kReplaced, kDamaged}) {
    for (int number = 1; fs::exists(Numbered(folder_ / name, number)); ++number) {
      const fs::path path = Numbered(folder_ / name, number);
      fs::remove_all(path, error);
      if (!error) LOG(INFO) << "Removed the older checkpoints in " << path.string();
    }
  }
  // A run killed while it wrote a checkpoint leaves one, which would keep the folder.
  RemoveAbandonedScratchFolders(folder_);
  // Removed last, because until then --resume 1 continues from it.
  fs::remove(folder_ / kTrained, error);
  fs::remove(folder_, error);
  if (!fs::exists(folder_, error)) return;
  LOG(WARNING) << folder_.string()
               << " holds files that are no checkpoints of this run, or cannot be removed: they "
                  "stay, and with them the folder, by which a run counts as not finished.";
}

bool HoldsStoppedTraining(const fs::path& output_path) {
  return fs::exists(output_path / kCheckpoints);
}

}  // namespace semfoam
