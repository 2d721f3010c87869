// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/options/training_run_options.h"

#include "foam/util/error.h"
#include "tools/cli/input_protection.h"
#include "tools/options/enum_option.h"
#include "tools/options/progress_option.h"

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Adds --quality and --FoamTraining.*. The preset is taken first; what the user gives by name wins.
void AddTrainingOptions(OptionManager* options, Quality* quality, TrainingOptions* training) {
  *training = OptionsForQuality(*quality);
  AddEnumOption(options,
                "quality",
                quality,
                kQualityNames,
                "presets num_rays, final_sites, sh_degree and the like",
                [quality, training] { *training = OptionsForQuality(*quality); });
  const auto add = [options](const std::string& name, auto* value, const std::string& help) {
    options->AddDefaultOption("FoamTraining." + name, value, help);
  };
  add("num_rays", &training->num_rays, "rays over the whole run");
  add("late_rays", &training->late_rays, "rays after densify_until; 0 = their share of num_rays");
  add("rays_per_iteration", &training->rays_per_iteration, "batch size");
  add("initial_sites", &training->initial_sites, "SfM points beyond this are thinned at random");
  add("final_sites", &training->final_sites, "what densification grows to");
  add("sh_degree",
      &training->sh_degree,
      "of the view-dependent colour, 0 to 3, at most: raised only while it pays");
  add("transmittance_cutoff",
      &training->transmittance_cutoff,
      "rays stop where this share of the light is left");
  add("opacity_weight", &training->opacity_weight, "weight of the opacity loss");
  add("quantile_weight", &training->quantile_weight, "weight of the depth quantile loss");
  add("distance_weight",
      &training->distance_weight,
      "weight of the loss of depths that differ from those of the plane sweep");
  add("identity_weight", &training->identity_weight, "weight of the labels' cross-entropy");
  add("identity_to_density",
      &training->identity_to_density,
      "share of the gradient of the labels' cross-entropy that flows into density and positions, "
      "0 to 1; 0 = the paper's way");
  add("tv_weight", &training->tv_weight, "weight of the identities' total variation");
  add("color_tv_weight",
      &training->color_tv_weight,
      "weight of the colours' variation between cells that touch; 0: none");
  add("position_rate",
      &training->position_rate,
      "learning rate of the sites, in radii of their cells");
  add("density_rate", &training->density_rate, "learning rate of the density");
  add("color_rate", &training->color_rate, "learning rate of the colour");
  add("sh_factor", &training->sh_factor, "higher SH degrees learn at this times color_rate");
  add("color_gradient_rate",
      &training->color_gradient_rate,
      "learning rate of the colour's change within a cell; 0: each cell is of one colour");
  add("identity_rate", &training->identity_rate, "learning rate of the identity features");
  add("classifier_rate", &training->classifier_rate, "learning rate of the classifier, constant");
  add("final_rate", &training->final_rate, "what learning rates fall to, as a share");
  add("densify_from", &training->densify_from, "first densification, as a share of the run");
  add("densify_until", &training->densify_until, "last densification, as a share of the run");
  add("densify_events", &training->densify_events, "number of densifications");
  add("freeze_positions",
      &training->freeze_positions,
      "sites stay from here on, as a share of the run");
}

// Logs the schedule as options, to be pasted.
void LogSchedule(const std::vector<std::pair<std::string, std::string>>& schedule) {
  std::string text;
  for (const auto& [name, value] : schedule) text += " --FoamTraining." + name + " " + value;
  LOG(INFO) << "The same foam again, without a budget:" << text;
}

}  // namespace

void AddTrainingRunOptions(OptionManager* options, TrainingRunOptions* training) {
  TrainingRun* const run = &training->run;
  options->AddDeviceOption();
  AddMaskPathOptions(options, &training->masks);
  options->AddDefaultOption(
      "ignore_path",
      &training->ignore_path,
      "folder of binary masks, PNGs named as COLMAP (a.jpg.png), Metashape (a_mask.png) or "
      "RealityCapture (a.mask.png) name them: nothing is learned from what is black, or "
      "transparent, "
      "in them; they are no objects");
  options->AddDefaultOption("invert",
                            &run->scene.ignore_inverted,
                            "1 = what is white, or opaque, in --ignore_path is ignored instead");
  options->AddDefaultOption("seed_path",
                            &training->seed_path,
                            "a dense point cloud to begin from, besides the SfM points: fused.ply, "
                            "or any PLY in the frame of the model");
  options->AddDefaultOption("test_every",
                            &run->scene.test_every,
                            "hold out every so many photos by name, from the first; 0 = none");
  options->AddDefaultOption("image_cache_gb",
                            &run->image_cache_gb,
                            "GB of memory for photos and masks; where they need more, only the "
                            "pixels that training draws are kept and files are read again, with "
                            "the same result; -1 = 3/4 of the free memory beside the foam");
  AddTrainingOptions(options, &run->quality, &run->training);
  options->AddDefaultOption("FoamTraining.time_budget",
                            &run->time_budget,
                            "seconds for all that foam_trainer does: chooses num_rays and with "
                            "them what the presets preset, by the speed of this machine; 0 = off");
  options->AddDefaultOption("FoamTraining.sweep_photos",
                            &run->sweep_photos,
                            "photos, at most, in which a plane sweep looks for surfaces without "
                            "SfM points, to begin from them too; 0 = none; has no effect with "
                            "--seed_path");
  options->AddDefaultOption("FoamTraining.max_image_size",
                            &run->scene.max_image_size,
                            "larger photos are reduced to this longest side, in pixels; -1 = none");
  AddProgressOption(options);
  AddMaskReadingOptions(options, &training->masks);
  AddEffectsOptions(options, &training->effects);
}

void AddCheckpointOptions(OptionManager* options, CheckpointOptions* checkpoints) {
  options->AddDefaultOption("checkpoint_every",
                            &checkpoints->every,
                            "seconds between checkpoints; 0 = only when the run is stopped");
  options->AddDefaultOption("preview_every",
                            &checkpoints->preview_every,
                            "seconds between previews of the training: previews/000123.png, and "
                            "previews/index.html, a page that reloads itself; 0 = none");
  options->AddDefaultOption(
      "resume", &checkpoints->resume, "goes on from the newest checkpoint in the output folder");
  options->AddDefaultOption("overwrite",
                            &checkpoints->overwrite,
                            "replaces the trained foam that the output folder holds, and the "
                            "exports that its labels.json lists, once the new ones are written");
}

void FinishTrainingRun(const OptionManager& options,
                       const std::string& workspace_path,
                       TrainingRunOptions* training) {
  TrainingRun* const run = &training->run;
  run->training.random_seed = options.RandomSeed();
  run->scene.image_path = training->image_path;
  run->scene.input_path = training->input_path;
  run->scene.seed_path = training->seed_path;
  run->scene.mask_path = training->masks.mask_path;
  run->scene.ignore_path = training->ignore_path;
  if (training->ignore_path.empty()) {
    options.RequireEffect({"invert"}, "without --ignore_path; give both, or neither");
  }
  run->scene.labels_path = training->masks.labels_path;
  run->scene.label_zero = training->masks.Zero();
  run->scene.mask_consistency = training->masks.Consistency();
  run->device = options.device();
  run->effects = MakeEffectsOptions(training->effects);
  if (!workspace_path.empty()) {
    RequireWorkspace(workspace_path);
    CompleteFromWorkspace(workspace_path, run);
  }
  CompleteTrainingRun(run);
  for (const char* name :
       {"num_rays", "rays_per_iteration", "final_sites", "sh_degree", "densify_events"}) {
    if (options.IsGiven(std::string("FoamTraining.") + name)) run->kept_options.insert(name);
  }
  run->when_schedule_is_known = LogSchedule;
  if (run->time_budget > 0) {
    options.WarnWithoutEffect({"quality"}, "beside --FoamTraining.time_budget");
  }
  if (!run->effects.semantics) {
    options.WarnWithoutEffect(
        {"mask_path", "labels_path", "Masks.consistency", "FoamTraining.label_zero"},
        "with --Effects.semantics off");
  }
  for (const char* name : {"num_rays", "late_rays"}) {
    if (run->time_budget > 0 && options.IsGiven(std::string("FoamTraining.") + name)) {
      throw UserError("Failed to parse options - --FoamTraining.",
                      name,
                      " and --FoamTraining.time_budget both say how long to train; give one of "
                      "them.");
    }
  }
}

void RequireSeedCloudIsKept(const TrainingRunOptions& training, const std::string& output_path) {
  namespace fs = std::filesystem;
  if (training.seed_path.empty()) return;
  const fs::path output = output_path;
  std::vector<fs::path> written;
  for (const char* name : {"scene.foam",
                           "effects.json",
                           "labels.json",
                           "training_log.csv",
                           "training_plot.svg",
                           "training_plot.png"}) {
    written.push_back(output / name);
  }
  for (const char* folder : {"objects", "checkpoints"}) {
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(output / folder, ignored)) {
      written.push_back(entry.path());
    }
  }
  CheckNoInputOverwrite({training.seed_path}, written);
}

std::string ResumeCommand(const OptionManager& options) {
  return options.CommandLineWith(program_invocation_name, "resume", "1");
}

}  // namespace semfoam
