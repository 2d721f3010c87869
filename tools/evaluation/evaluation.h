// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/device.h"
#include "foam/image/image.h"
#include "foam/model/model.h"
#include "plugin/colmap/camera_rays.h"
#include "plugin/photometric/expected_light.h"
#include "tools/evaluation/label_scores.h"

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace semfoam {

struct ViewScore {
  std::string name;
  double psnr = 0;  // dB
  double ssim = 0;
};

// Pictures of one view, of the photo's size in training.
struct ViewMaps {
  // The photo and the render as they were compared.
  Image8 photo;
  Image8 render;
  // The rendered ids in their colours (PaletteImage). Empty without semantics.
  Image8 labels;
  // Mean absolute difference of a pixel's channels (ErrorImage).
  Image8 error;
  // Grey, 255 = 1; black where the foam shows no label. Empty without semantics.
  Image8 confidence;
};

using OnViewMaps = std::function<void(const std::string& name, const ViewMaps& maps)>;

// The quality of a foam on held-out photos.
struct Scores {
  // One per held-out photo.
  std::vector<ViewScore> views;
  // By name; ViewLabelScore::view is an index into `views`.
  std::map<std::string, ObjectScore> objects;
  // A sentence about each object that no exact mask shows.
  std::vector<std::string> unscored;
};

struct ScoreOptions {
  std::filesystem::path image_path;  // folder of the photos
  // Folder of the exact masks, `<object>/<photo>.png` (with the photo's folder, or else without);
  // empty = labels are not scored.
  std::filesystem::path truth_path;
  // Whether to score colour on the photos' right halves, in the exposure that fits their left ones
  // (FitExposure).
  bool fit_exposure = false;
  // Rays along each edge of a pixel, see RenderCamera.
  int supersample = kDefaultSupersample;
  // Renders the views.
  Device device;
  // Indices of the photos to score; empty: those that were held out.
  std::vector<size_t> photos = {};
  // Puts renders in the light of their photos (OfPhoto), before fit_exposure; null: reference.
  const ExpectedLights* lights = nullptr;
};

// Renders every held-out photo of `model`, or those of the options, and compares it with the photo
// in `image_path`, brought to the size in the model, and the labels with the exact masks.
// `foam_path` is what errors call the model. Calls `on_maps` (if any) with each view's maps. Throws
// UserError naming the photo or mask that is missing, damaged or of another aspect.
Scores ScoreModel(const Model& model,
                  const std::filesystem::path& foam_path,
                  const ScoreOptions& options,
                  const OnViewMaps& on_maps = nullptr);

ViewScore MeanOf(const std::vector<ViewScore>& views);

// Returns the mean prompt score of one view over the objects in it; nothing without objects.
std::optional<LabelScore> MeanOfView(const std::map<std::string, ObjectScore>& objects,
                                     size_t view);

// Returns the mean over the objects that have this kind of score (see LabelScore); nothing without
// any.
std::optional<LabelScore> MeanOf(const std::map<std::string, ObjectScore>& objects, bool direct);

// Returns the folder of exact masks: the one that the user gave (throws UserError where it does not
// exist), or segmentation_labels/masks/ beside the photos, as in data sets; empty where that does
// not exist.
std::filesystem::path FindTruth(const std::filesystem::path& truth_path,
                                const std::filesystem::path& image_path);

}  // namespace semfoam
