// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/names.h"
#include "foam/model/model.h"
#include "foam/util/error.h"
#include "foam/util/output_file.h"
#include "foam/util/photo_name.h"
#include "tools/cli/input_protection.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/effects_report.h"
#include "tools/evaluation/evaluation.h"
#include "tools/images/image_files.h"
#include "tools/options/enum_option.h"
#include "tools/options/json_option.h"
#include "tools/options/pixel_sampling.h"
#include "tools/support/output_lock.h"

#include <cstdio>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

void Print(const ViewScore& view, const std::optional<LabelScore>& labels) {
  std::printf("%-32s %8.2f %8.4f", OneLine(view.name).c_str(), view.psnr, view.ssim);
  if (labels.has_value()) std::printf(" %8.3f", labels->iou);
  std::printf("\n");
}

void Print(const std::optional<LabelScore>& score) {
  if (score.has_value()) {
    std::printf(" %8.3f %8.3f %8.3f", score->iou, score->recall, score->boundary_iou);
  } else {
    std::printf(" %8s %8s %8s", "-", "-", "-");
  }
}

void Print(const std::string& name,
           const std::optional<LabelScore>& direct,
           const LabelScore& prompt) {
  std::printf("%-24s", OneLine(name).c_str());
  Print(direct);
  Print(std::optional<LabelScore>(prompt));
  std::printf("\n");
}

void Print(const Scores& scores) {
  const bool has_labels = !scores.objects.empty();
  std::printf("%-32s %8s %8s%s\n", "held-out view", "PSNR", "SSIM", has_labels ? "     mIoU" : "");
  for (size_t i = 0; i < scores.views.size(); ++i) {
    Print(scores.views[i], MeanOfView(scores.objects, i));
  }
  Print(MeanOf(scores.views), std::nullopt);
  if (!has_labels) return;
  std::printf("\n%-24s %-26s %-26s\n", "", "  label of that id", "  label by the prompt");
  std::printf("%-24s %8s %8s %8s %8s %8s %8s\n",
              "object",
              "IoU",
              "recall",
              "boundary",
              "IoU",
              "recall",
              "boundary");
  for (const auto& [name, score] : scores.objects) Print(name, score.direct, score.prompt);
  Print("mean", MeanOf(scores.objects, true), *MeanOf(scores.objects, false));
}

// "iou" or "mIoU", ...: the same names as means have.
ordered_json ToJson(const LabelScore& score, bool is_mean = false) {
  return {{is_mean ? "mIoU" : "iou", score.iou},
          {is_mean ? "mAcc" : "recall", score.recall},
          {is_mean ? "boundary_mIoU" : "boundary_iou", score.boundary_iou}};
}

ordered_json ToJson(const Scores& scores) {
  const ViewScore mean = MeanOf(scores.views);
  ordered_json json = {{"frames", scores.views.size()}, {"psnr", mean.psnr}, {"ssim", mean.ssim}};
  for (const bool direct : {false, true}) {
    if (const std::optional<LabelScore> labels = MeanOf(scores.objects, direct)) {
      json[direct ? "direct" : "prompt"] = ToJson(*labels, /*is_mean=*/true);
    }
  }
  for (const ViewScore& view : scores.views) {
    json["views"].push_back({{"name", view.name}, {"psnr", view.psnr}, {"ssim", view.ssim}});
  }
  for (const auto& [name, score] : scores.objects) {
    ordered_json& object = json["objects"][name];
    object["prompt_labels"] = score.prompt_labels;
    object["prompt"] = ToJson(score.prompt);
    if (score.direct.has_value()) object["direct"] = ToJson(*score.direct);
    for (const ViewLabelScore& view : score.views) {
      ordered_json of_view = {{"name", scores.views[view.view].name},
                              {"prompt", ToJson(view.prompt)}};
      if (view.direct.has_value()) of_view["direct"] = ToJson(*view.direct);
      object["views"].push_back(of_view);
    }
  }
  return json;
}

// An object is called as its folder; a file system takes names that JSON does not.
void RequireNamesForJson(const fs::path& truth) {
  for (const fs::directory_entry& folder : fs::directory_iterator(truth)) {
    if (!folder.is_directory() || IsUtf8(folder.path().filename().string())) continue;
    throw UserError(folder.path().string(),
                    ": its name is not UTF-8 and cannot stand in a JSON file; rename it, or leave "
                    "--json_path out.");
  }
}

fs::path MapFile(const fs::path& folder, const char* kind, const std::string& photo) {
  return folder / kind / fs::path(photo).lexically_normal().replace_extension(".png");
}

// Neither would two maps have one name, nor take the place of a photo or of another's file.
void RequireRoomForMaps(const Model& model,
                        const fs::path& foam_path,
                        const fs::path& image_path,
                        const fs::path& maps_path) {
  std::set<fs::path> errors;
  std::vector<fs::path> photos;
  std::vector<fs::path> maps;
  for (const PhotoRecord& photo : model.photos) {
    if (!photo.held_out) continue;
    photos.push_back(image_path / photo.name);
    for (const char* kind : {"error", "confidence"}) {
      maps.push_back(MapFile(maps_path, kind, photo.name));
    }
    if (!errors.insert(MapFile(maps_path, "error", photo.name)).second) {
      throw UserError(foam_path.string(),
                      ": has two photos ",
                      fs::path(photo.name).stem().string(),
                      ".*, whose maps would have the same name; leave --maps_path out.");
    }
  }
  CheckNoInputOverwrite(photos, maps, "maps_path");
  RequireOwnImages(maps, "maps_path");
}

// When to fit the exposure of the photos.
enum class ExposureFit { kAuto, kNever, kAlways };
constexpr EnumName<ExposureFit> kExposureFitNames[] = {
    {ExposureFit::kAuto, "auto"}, {ExposureFit::kNever, "0"}, {ExposureFit::kAlways, "1"}};

// Options of the command line.
struct EvaluatorOptions {
  std::string foam_path;
  std::string image_path;
  std::string truth_path;
  bool json = false;
  std::string json_path;
  std::string maps_path;
  ExposureFit fit_exposure = ExposureFit::kAuto;
  int supersample = kDefaultSupersample;
};

void AddOptions(OptionManager* options, EvaluatorOptions* evaluator) {
  options->AddDeviceOption();
  options->AddRequiredOption("foam_path", &evaluator->foam_path, "the model, scene.foam");
  options->AddRequiredOption("image_path", &evaluator->image_path, "folder of the photos");
  options->AddDefaultOption(
      "truth_path",
      &evaluator->truth_path,
      "folder of exact masks, <object>/<photo>.png, white where the object is; "
      "by default segmentation_labels/masks/ beside the photos' folder");
  AddEnumOption(
      options,
      "fit_exposure",
      &evaluator->fit_exposure,
      kExposureFitNames,
      "colour: fit each photo's exposure on its left half and score the right one; auto = where "
      "the foam was trained with exposure on");
  AddSupersampleOption(options, &evaluator->supersample);
  AddJsonOption(options, &evaluator->json);
  options->AddDefaultOption(
      "json_path", &evaluator->json_path, "also write the scores to this file");
  options->AddDefaultOption(
      "maps_path",
      &evaluator->maps_path,
      "also write maps of every view into this folder: error/*.png (black = "
      "none, white = a quarter of the range) and confidence/*.png (white = 1)");
}

// Writes the maps of one view after the other into this folder.
OnViewMaps MapWriter(const fs::path& maps_path) {
  return [maps_path](const std::string& name, const ViewMaps& maps) {
    WriteRgbPng(MapFile(maps_path, "error", name), maps.error);
    if (maps.confidence.width == 0) return;
    WriteRgbPng(MapFile(maps_path, "confidence", name), maps.confidence);
  };
}

}  // namespace

void RunFoamEvaluator(int argc, char** argv) {
  EvaluatorOptions evaluator;
  OptionManager options("foam_evaluator",
                        "Scores a foam on the photos that its training held out: PSNR and SSIM, "
                        "and where there are exact masks, IoU, recall and boundary IoU of every "
                        "object.");
  AddOptions(&options, &evaluator);
  if (!options.Parse(argc, argv)) return;

  CheckSupersample(evaluator.supersample);
  const auto& [foam_path,
               image_path,
               truth_path,
               json,
               json_path,
               maps_path,
               fit_exposure,
               supersample] = evaluator;
  std::optional<OutputLock> lock;
  if (!maps_path.empty()) lock.emplace(maps_path);
  const fs::path truth = FindTruth(truth_path, image_path);
  if (!json_path.empty()) {
    CheckNoInputOverwrite({foam_path}, {json_path}, "json_path");
    if (!truth.empty()) RequireNamesForJson(truth);
  }
  const Model model = ReadModel(foam_path);
  const bool fits_exposure = fit_exposure == ExposureFit::kAlways ||
                             (fit_exposure == ExposureFit::kAuto && AdaptsLight(model));
  OnViewMaps write_maps;
  if (!maps_path.empty()) {
    RequireRoomForMaps(model, foam_path, image_path, maps_path);
    write_maps = MapWriter(maps_path);
  }
  const std::optional<ExpectedLights> lights = FindExpectedLights(foam_path, model);
  const Scores scores = ScoreModel(model,
                                   foam_path,
                                   {image_path,
                                    truth,
                                    fits_exposure,
                                    supersample,
                                    options.device(),
                                    /*photos=*/{},
                                    lights ? &*lights : nullptr},
                                   write_maps);
  if (scores.views.empty()) {
    throw UserError(foam_path,
                    ": no photo was held out of this training, so there is nothing to score it on; "
                    "train with --test_every 8.");
  }
  for (const std::string& sentence : scores.unscored) LOG(WARNING) << sentence;
  if (json) {
    PrintJson(ToJson(scores));
  } else {
    Print(scores);
  }
  if (!json_path.empty()) WriteTextFile(json_path, ToJson(scores).dump(1) + "\n");
}

}  // namespace semfoam
