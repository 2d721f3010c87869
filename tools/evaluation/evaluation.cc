// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/evaluation.h"

#include "foam/image/metrics.h"
#include "foam/util/error.h"
#include "foam/view/view_renderer.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/photo/photo.h"
#include "tools/evaluation/exposure_fit.h"
#include "tools/images/image_files.h"
#include "tools/images/view_images.h"
#include "tools/support/memory_task.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// The objects that have exact masks, and what of them has been scored.
class ObjectScorers {
 public:
  // The folders of masks in `truth_path`; none where that is empty.
  ObjectScorers(const fs::path& truth_path, const Model& model) {
    if (truth_path.empty()) return;
    std::map<std::string, LabelId> id_of_name;
    for (const Label& label : model.labels) id_of_name[label.name] = label.id;
    for (const fs::directory_entry& folder : fs::directory_iterator(truth_path)) {
      if (!folder.is_directory()) continue;
      const auto id = id_of_name.find(folder.path().filename().string());
      objects_.emplace(folder.path(),
                       id == id_of_name.end() ? std::nullopt : std::optional<LabelId>(id->second));
    }
  }

  // The labels that were rendered of the next view. One without a mask counts as one with an empty
  // mask, so that places stay.
  void Add(const fs::path& photo, const LabelImage& ids) {
    ++num_views_;
    for (auto& [folder, object] : objects_) {
      object.scorer.Add(ids, MaskOf(photo, ids, folder, &object));
    }
  }

  // By the folders' names.
  void Finish(Scores* scores) const {
    for (const auto& [folder, object] : objects_) {
      if (const auto score = object.scorer.Finish()) {
        scores->objects[folder.filename().string()] = *score;
      } else if (num_views_ > 0) {
        scores->unscored.push_back(WhyUnscored(folder, object));
      }
    }
  }

 private:
  struct Object {
    explicit Object(std::optional<LabelId> id) : scorer(id) {}

    ObjectScorer scorer;
    int num_masks = 0;
    Foreground brightest;  // without its pixels
  };

  // The exact mask of the view; empty, all 0, where there is none.
  static LabelImage MaskOf(const fs::path& photo,
                           const LabelImage& ids,
                           const fs::path& folder,
                           Object* object) {
    for (const fs::path& name : {photo, photo.filename()}) {
      const fs::path file = (folder / name).replace_extension(".png");
      if (!fs::exists(file)) continue;
      const Foreground foreground = ReadForeground(file);
      if (object->num_masks++ == 0 || foreground.largest > object->brightest.largest) {
        object->brightest = {{}, foreground.largest, foreground.white};
      }
      return ResizeNearest(foreground.mask, ids.width, ids.height);
    }
    return {ids.width, ids.height, std::vector<int32_t>(size_t{1} * ids.width * ids.height, 0)};
  }

  std::string WhyUnscored(const fs::path& folder, const Object& object) const {
    const std::string what = folder.string() + ": this object is not scored, because ";
    if (object.num_masks == 0) {
      return what + "no file there is named as a held-out photo; <photo>.png would be right.";
    }
    if (object.brightest.largest == 0) {
      return what + "its masks of all held-out photos are empty; does no such photo show it?";
    }
    return what + "the largest value in its masks is " + std::to_string(object.brightest.largest) +
           " of " + std::to_string(object.brightest.white) +
           "; 0 and white, or 0 and 1, would be right.";
  }

  int num_views_ = 0;
  std::map<fs::path, Object> objects_;
};

Image8 ConfidenceImage(const RenderedView& rendered) {
  Image8 image{rendered.width, rendered.height, {}};
  for (const float confidence : rendered.confidence) {
    image.data.insert(image.data.end(), 3, static_cast<uint8_t>(std::lround(255 * confidence)));
  }
  return image;
}

// Renders one held-out view and scores its colours and labels.
ViewScore ScoreView(size_t index,
                    const fs::path& foam_path,
                    const Model& model,
                    const ViewRenderer& renderer,
                    const ScoreOptions& options,
                    const OnViewMaps& on_maps,
                    ObjectScorers* objects) {
  const PhotoRecord& photo = model.photos[index];
  Image8 truth = ReadPhoto(options.image_path / photo.name);
  const PhotoSize trained = {photo.width, photo.height};
  // As training reduced it, --FoamTraining.max_image_size.
  if (truth.width > trained.width && SameAspect({truth.width, truth.height}, trained)) {
    truth = ReducePhoto(truth, trained);
  }
  if (truth.width != photo.width || truth.height != photo.height) {
    throw UserError((options.image_path / photo.name).string(),
                    ": is ",
                    truth.width,
                    "x",
                    truth.height,
                    ", the photo in training was ",
                    photo.width,
                    "x",
                    photo.height,
                    "; ",
                    Field{"image_path"},
                    " takes the photos of the training.");
  }
  RenderedView rendered = RenderCamera(renderer,
                                       CameraOf(photo, foam_path),
                                       PoseOf(photo),
                                       model.world_from_normalized,
                                       options.supersample);
  if (options.lights != nullptr) PutInLight(options.lights->OfPhoto(index), &rendered);
  const LabelImage ids =
      model.foam.HasSemantics() ? LabelIdImage(rendered, model.labels) : LabelImage{};
  if (model.foam.HasSemantics()) objects->Add(photo.name, ids);
  Image8 render = ColorImage(rendered);
  if (options.fit_exposure) render = WithGains(render, FitGains(render, truth));
  const auto compare = [&](const Image8& shown, const Image8& photographed) {
    return ViewScore{photo.name, Psnr(shown, photographed), Ssim(shown, photographed)};
  };
  const ViewScore score =
      options.fit_exposure ? compare(RightHalf(render), RightHalf(truth)) : compare(render, truth);
  if (on_maps) {
    ViewMaps maps;
    maps.error = ErrorImage(render, truth);
    if (model.foam.HasSemantics()) {
      maps.labels = PaletteImage(ids);
      maps.confidence = ConfidenceImage(rendered);
    }
    maps.photo = std::move(truth);
    maps.render = std::move(render);
    on_maps(photo.name, maps);
  }
  return score;
}

std::optional<LabelScore> MeanOf(const std::vector<LabelScore>& scores) {
  if (scores.empty()) return std::nullopt;
  LabelScore mean;
  for (const LabelScore& score : scores) mean.Add(score, 1.0 / static_cast<double>(scores.size()));
  return mean;
}

}  // namespace

Scores ScoreModel(const Model& model,
                  const fs::path& foam_path,
                  const ScoreOptions& options,
                  const OnViewMaps& on_maps) {
  const MemoryTask task("held-out views are rendered and scored", "smaller photos");
  const ViewRenderer renderer(model.foam, options.device);
  ObjectScorers objects(options.truth_path, model);
  Scores scores;
  for (size_t i = 0; i < model.photos.size(); ++i) {
    const PhotoRecord& photo = model.photos[i];
    const bool is_scored =
        options.photos.empty()
            ? photo.held_out
            : std::find(options.photos.begin(), options.photos.end(), i) != options.photos.end();
    if (!is_scored) continue;
    scores.views.push_back(ScoreView(i, foam_path, model, renderer, options, on_maps, &objects));
  }
  objects.Finish(&scores);
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

std::optional<LabelScore> MeanOfView(const std::map<std::string, ObjectScore>& objects,
                                     size_t view) {
  std::vector<LabelScore> scores;
  for (const auto& [name, object] : objects) {
    for (const ViewLabelScore& score : object.views) {
      if (score.view == view) scores.push_back(score.prompt);
    }
  }
  return MeanOf(scores);
}

std::optional<LabelScore> MeanOf(const std::map<std::string, ObjectScore>& objects, bool direct) {
  std::vector<LabelScore> scores;
  for (const auto& [name, object] : objects) {
    if (!direct) {
      scores.push_back(object.prompt);
    } else if (object.direct.has_value()) {
      scores.push_back(*object.direct);
    }
  }
  return MeanOf(scores);
}

fs::path FindTruth(const fs::path& truth_path, const fs::path& image_path) {
  if (!truth_path.empty()) {
    if (!fs::is_directory(truth_path)) {
      throw UserError(truth_path.string(),
                      ": there is no such folder; ",
                      Field{"truth_path"},
                      " takes the folder that holds one "
                      "folder of masks for each object.");
    }
    const auto is_folder = [](const fs::directory_entry& entry) { return entry.is_directory(); };
    if (std::none_of(fs::directory_iterator(truth_path), fs::directory_iterator(), is_folder)) {
      throw UserError(truth_path.string(),
                      ": holds no folder of an object's masks; ",
                      Field{"truth_path"},
                      " takes the folder that "
                      "holds one for each object.");
    }
    return truth_path;
  }
  // With and without a slash at the end, the photos' folder has the same neighbours.
  const fs::path neighbor =
      fs::absolute(image_path / "").parent_path().parent_path() / "segmentation_labels" / "masks";
  return fs::is_directory(neighbor) ? neighbor : fs::path();
}

}  // namespace semfoam
