// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/error.h"
#include "tools/commands/commands.h"
#include "tools/controllers/effects_report.h"
#include "tools/controllers/training_run.h"
#include "tools/options/json_option.h"
#include "tools/options/training_run_options.h"
#include "tools/support/output_lock.h"

#include <cstdio>
#include <filesystem>
#include <string>

namespace semfoam {

void RunSceneAnalyzer(int argc, char** argv) {
  std::string output_path;
  bool json = false;
  TrainingRunOptions training;
  OptionManager options("scene_analyzer",
                        "Says which effects a scene calls for, as foam_trainer decides it with "
                        "the same options: exposure, vignetting, view dependence ...");
  options.AddRequiredOption("image_path", &training.image_path, "folder of the photos");
  options.AddRequiredOption("input_path", &training.input_path, "the COLMAP model, sparse/0");
  options.AddRequiredOption("output_path", &output_path, "folder for effects.json");
  AddTrainingRunOptions(&options, &training);
  AddJsonOption(&options, &json);
  options.SetFrequentOptions({"mask_path",
                              "test_every",
                              "Effects.exposure",
                              "Effects.white_balance",
                              "Effects.vignetting",
                              "Effects.distortion",
                              "Effects.sh_degree",
                              "json"});
  if (!options.Parse(argc, argv)) return;
  FinishTrainingRun(options, {}, &training);
  const TrainingRun& run = training.run;

  const OutputLock lock(output_path);
  const std::filesystem::path effects_path = std::filesystem::path(output_path) / "effects.json";
  if (std::filesystem::exists(std::filesystem::path(output_path) / "scene.foam") &&
      std::filesystem::exists(effects_path)) {
    throw UserError(effects_path.string(),
                    ": belongs to the trained foam in its folder; another --output_path would be "
                    "right.");
  }
  const TrainingScene scene = LoadScene(run, run.scene);
  LogWarnings(scene);
  const SceneEffects effects = ProbeEffects(scene, run.effects);
  if (json) {
    std::fputs(EffectsJson(effects, scene.Photos()).c_str(), stdout);
  } else {
    for (const std::string& line : EffectsTable(effects)) std::printf("%s\n", line.c_str());
  }
  WriteEffects(effects_path, effects, scene.Photos());
}

}  // namespace semfoam
