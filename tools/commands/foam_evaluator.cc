// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/error.h"
#include "foam/metrics.h"
#include "foam/model.h"
#include "foam/output_file.h"
#include "foam/view_renderer.h"
#include "plugin/camera_rays.h"
#include "plugin/photo.h"
#include "tools/commands.h"
#include "tools/exposure_fit.h"
#include "tools/image_files.h"
#include "tools/label_scores.h"
#include "tools/option_manager.h"
#include "tools/view_images.h"

#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct ViewScore {
  std::string name;
  double psnr = 0;
  double ssim = 0;
};

struct Scores {
  std::vector<ViewScore> views;
  std::map<std::string, ObjectScore> objects;  // by name
};

std::string Stem(const std::string& photo_name) { return fs::path(photo_name).stem().string(); }

// Renders one held-out view and scores its colours; keeps its labels for later, by stem.
ViewScore ScoreView(const PhotoRecord& photo,
                    const fs::path& foam_path,
                    const fs::path& image_path,
                    const Model& model,
                    const ViewRenderer& renderer,
                    bool fit_exposure,
                    std::map<std::string, LabelImage>* ids_of_stem) {
  const Image8 truth = ReadPhoto(image_path / photo.name);
  if (truth.width != photo.width || truth.height != photo.height) {
    throw UserError((image_path / photo.name).string(),
                    ": is ",
                    truth.width,
                    "x",
                    truth.height,
                    ", the photo in training was ",
                    photo.width,
                    "x",
                    photo.height,
                    "; --image_path takes the photos of the training.");
  }
  const RenderedView rendered =
      renderer.Render(MakeCameraRays(photo, model.world_from_normalized, foam_path));
  if (model.foam.HasSemantics()) {
    (*ids_of_stem)[Stem(photo.name)] = IdImage(rendered, model.labels);
  }
  const Image8 color = ColorImage(rendered);
  if (fit_exposure) {
    const ImagePair right = FitExposure(color, truth);
    return {photo.name, Psnr(right.render, right.photo), Ssim(right.render, right.photo)};
  }
  return {photo.name, Psnr(color, truth), Ssim(color, truth)};
}

// The scores of every folder of masks, by its name.
std::map<std::string, ObjectScore> ScoreObjects(
    const fs::path& truth_path,
    const Model& model,
    const std::map<std::string, LabelImage>& ids_of_stem) {
  std::map<std::string, int32_t> id_of_name;
  for (const Label& label : model.labels) id_of_name[label.name] = label.id;
  std::map<std::string, ObjectScore> scores;
  for (const fs::directory_entry& folder : fs::directory_iterator(truth_path)) {
    if (!folder.is_directory()) continue;
    std::vector<MaskedView> views;
    for (const auto& [stem, ids] : ids_of_stem) {
      const fs::path mask = folder.path() / (stem + ".png");
      if (!fs::exists(mask)) continue;
      views.push_back({&ids, ResizeNearest(ReadForeground(mask), ids.width, ids.height)});
    }
    const std::string name = folder.path().filename().string();
    const auto id = id_of_name.find(name);
    const std::optional<ObjectScore> score = ScoreObject(
        views, id == id_of_name.end() ? std::nullopt : std::optional<int32_t>(id->second));
    if (score.has_value()) scores[name] = *score;
  }
  return scores;
}

ViewScore MeanOf(const std::vector<ViewScore>& views) {
  ViewScore mean{"mean", 0, 0};
  for (const ViewScore& view : views) {
    mean.psnr += view.psnr / static_cast<double>(views.size());
    mean.ssim += view.ssim / static_cast<double>(views.size());
  }
  return mean;
}

// Over the objects that have this reading; nothing where none has.
std::optional<LabelScore> MeanOf(const std::map<std::string, ObjectScore>& objects, bool direct) {
  LabelScore mean;
  int count = 0;
  for (const auto& [name, object] : objects) {
    if (direct && !object.direct.has_value()) continue;
    const LabelScore& score = direct ? *object.direct : object.prompt;
    mean.iou += score.iou;
    mean.recall += score.recall;
    ++count;
  }
  if (count == 0) return std::nullopt;
  mean.iou /= count;
  mean.recall /= count;
  return mean;
}

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

// The folder of exact masks: what the user gave, or where data sets have it, if it is there.
fs::path FindTruth(const fs::path& truth_path, const fs::path& image_path) {
  if (!truth_path.empty()) {
    if (!fs::is_directory(truth_path)) {
      throw UserError(truth_path.string(),
                      ": there is no such folder; --truth_path takes the folder that holds one "
                      "folder of masks for each object.");
    }
    return truth_path;
  }
  // With and without a slash at the end, the photos' folder has the same neighbours.
  const fs::path neighbor =
      fs::absolute(image_path / "").parent_path().parent_path() / "segmentation_labels" / "masks";
  return fs::is_directory(neighbor) ? neighbor : fs::path();
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
  const ViewRenderer renderer(model.foam);
  std::map<std::string, LabelImage> ids_of_stem;
  Scores scores;
  for (const PhotoRecord& photo : model.photos) {
    if (!photo.held_out) continue;
    scores.views.push_back(
        ScoreView(photo, foam_path, image_path, model, renderer, fits_exposure, &ids_of_stem));
  }
  if (scores.views.empty()) {
    throw UserError(foam_path,
                    ": no photo was held out of this training, so there is nothing to score it on; "
                    "train with --test_every 8.");
  }
  if (!truth.empty()) scores.objects = ScoreObjects(truth, model, ids_of_stem);
  Print(scores);
  if (!json_path.empty()) WriteTextFile(json_path, ToJson(scores).dump(1) + "\n");
}

}  // namespace semfoam
