// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation.h"

#include "foam/error.h"
#include "foam/metrics.h"
#include "foam/view_renderer.h"
#include "plugin/camera_rays.h"
#include "plugin/photo.h"
#include "tools/exposure_fit.h"
#include "tools/image_files.h"
#include "tools/view_images.h"

namespace semfoam {
namespace {

namespace fs = std::filesystem;

std::string Stem(const std::string& photo_name) { return fs::path(photo_name).stem().string(); }

// Renders one held-out view and scores its colours; keeps its labels for later, by stem.
ViewScore ScoreView(const PhotoRecord& photo,
                    const fs::path& foam_path,
                    const fs::path& image_path,
                    const Model& model,
                    const ViewRenderer& renderer,
                    bool fit_exposure,
                    std::map<std::string, LabelImage>* ids_of_stem) {
  Image8 truth = ReadPhoto(image_path / photo.name);
  const PhotoSize trained = {photo.width, photo.height};
  // As training reduced it, --FoamTraining.max_image_size.
  if (truth.width > trained.width && SameAspect({truth.width, truth.height}, trained)) {
    truth = ReducePhoto(truth, trained);
  }
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

}  // namespace

Scores ScoreModel(const Model& model,
                  const fs::path& foam_path,
                  const fs::path& image_path,
                  const fs::path& truth_path,
                  bool fit_exposure) {
  const ViewRenderer renderer(model.foam);
  std::map<std::string, LabelImage> ids_of_stem;
  Scores scores;
  for (const PhotoRecord& photo : model.photos) {
    if (!photo.held_out) continue;
    scores.views.push_back(
        ScoreView(photo, foam_path, image_path, model, renderer, fit_exposure, &ids_of_stem));
  }
  if (!truth_path.empty()) scores.objects = ScoreObjects(truth_path, model, ids_of_stem);
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

}  // namespace semfoam
