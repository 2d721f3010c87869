// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/error.h"
#include "foam/model.h"
#include "foam/output_file.h"
#include "tools/commands.h"
#include "tools/evaluation.h"
#include "tools/option_manager.h"

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

void Print(const ViewScore& view) {
  std::printf("%-32s %8.2f %8.4f\n", view.name.c_str(), view.psnr, view.ssim);
}

void Print(const std::string& name,
           const std::optional<LabelScore>& direct,
           const LabelScore& prompt) {
  std::printf("%-32s ", name.c_str());
  if (direct.has_value()) {
    std::printf("%10.3f %8.3f", direct->iou, direct->recall);
  } else {
    std::printf("%10s %8s", "-", "-");
  }
  std::printf(" %10.3f %8.3f\n", prompt.iou, prompt.recall);
}

void Print(const Scores& scores) {
  std::printf("%-32s %8s %8s\n", "held-out view", "PSNR", "SSIM");
  for (const ViewScore& view : scores.views) Print(view);
  Print(MeanOf(scores.views));
  if (scores.objects.empty()) return;
  std::printf(
      "\n%-32s %10s %8s %10s %8s\n", "object", "direct IoU", "recall", "prompt IoU", "recall");
  for (const auto& [name, score] : scores.objects) Print(name, score.direct, score.prompt);
  Print("mean", MeanOf(scores.objects, true), *MeanOf(scores.objects, false));
}

ordered_json ToJson(const LabelScore& score, const char* iou, const char* recall) {
  return {{iou, score.iou}, {recall, score.recall}};
}

ordered_json ToJson(const Scores& scores) {
  const ViewScore mean = MeanOf(scores.views);
  ordered_json json = {{"frames", scores.views.size()}, {"psnr", mean.psnr}, {"ssim", mean.ssim}};
  for (const bool direct : {false, true}) {
    if (const std::optional<LabelScore> labels = MeanOf(scores.objects, direct)) {
      json[direct ? "direct" : "prompt"] = ToJson(*labels, "mIoU", "mAcc");
    }
  }
  for (const ViewScore& view : scores.views) {
    json["views"].push_back({{"name", view.name}, {"psnr", view.psnr}, {"ssim", view.ssim}});
  }
  for (const auto& [name, score] : scores.objects) {
    ordered_json& object = json["objects"][name];
    object["views"] = score.num_views;
    object["prompt_labels"] = score.prompt_labels;
    object["prompt"] = ToJson(score.prompt, "iou", "recall");
    if (score.direct.has_value()) object["direct"] = ToJson(*score.direct, "iou", "recall");
  }
  return json;
}

}  // namespace

void RunFoamEvaluator(int argc, char** argv) {
  std::string foam_path;
  std::string image_path;
  std::string truth_path;
  std::string json_path;
  std::string fit_exposure = "auto";
  OptionManager options("foam_evaluator",
                        "Scores a foam on the photos that its training held out: PSNR and SSIM, "
                        "and where there are exact masks, IoU and recall of every object.");
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  options.AddRequiredOption("image_path", &image_path, "folder of the photos");
  options.AddDefaultOption(
      "truth_path",
      &truth_path,
      "folder of exact masks, <object>/<photo>.png, white where the object is; "
      "by default segmentation_labels/masks/ beside the photos' folder");
  options.AddChoiceOption(
      "fit_exposure",
      &fit_exposure,
      {"auto", "0", "1"},
      "colour: fit each photo's exposure on its left half and score the right one; auto = where "
      "the foam was trained with exposure on");
  options.AddDefaultOption("json_path", &json_path, "also write the scores to this file");
  if (!options.Parse(argc, argv)) return;

  const fs::path truth = FindTruth(truth_path, image_path);
  const Model model = ReadModel(foam_path);
  const bool fits_exposure =
      fit_exposure == "1" || (fit_exposure == "auto" && model.options.contains("exposure"));
  const Scores scores = ScoreModel(model, foam_path, image_path, truth, fits_exposure);
  if (scores.views.empty()) {
    throw UserError(foam_path,
                    ": no photo was held out of this training, so there is nothing to score it on; "
                    "train with --test_every 8.");
  }
  Print(scores);
  if (!json_path.empty()) WriteTextFile(json_path, ToJson(scores).dump(1) + "\n");
}

}  // namespace semfoam
