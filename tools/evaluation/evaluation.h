// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/device.h"
#include "foam/image/image.h"
#include "foam/model/model.h"
#include "plugin/colmap/camera_rays.h"
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

// What one held-out view shows of its error and of its certainty, as pictures.
struct ViewMaps {
  Image8 error;       // the mean difference of a pixel's channels, see ErrorImage
  Image8 confidence;  // grey, 255 = 1; black where the foam shows no label. Empty without semantics
};

using OnViewMaps = std::function<void(const std::string& name, const ViewMaps& maps)>;

// How well a foam shows what its training did not see.
struct Scores {
  std::vector<ViewScore> views;                // one per held-out photo
  std::map<std::string, ObjectScore> objects;  // by name; their views are places in `views`
  std::vector<std::string>
      unscored;  // of each object whose exact masks show it nowhere, a sentence
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
};

// Renders every held-out photo of `model` and compares it with the photo in `image_path`, brought
// to the size in the model, and the labels with the exact masks. `foam_path` is what errors call
// the model. Calls `on_maps` (if any) with each view's maps. Throws UserError naming the photo or
// mask that is missing, damaged or of another aspect.
Scores ScoreModel(const Model& model,
                  const std::filesystem::path& foam_path,
                  const ScoreOptions& options,
                  const OnViewMaps& on_maps = nullptr);

ViewScore MeanOf(const std::vector<ViewScore>& views);

// One view's mean over the objects in it, by the prompt; nothing where there are none.
std::optional<LabelScore> MeanOfView(const std::map<std::string, ObjectScore>& objects,
                                     size_t view);

// Over the objects that have this reading (see LabelScore); nothing where none has.
std::optional<LabelScore> MeanOf(const std::map<std::string, ObjectScore>& objects, bool direct);

// The folder of exact masks: what the user gave (throws UserError where there is none), or where
// data sets have it beside the photos, segmentation_labels/masks/; empty where it is not there.
std::filesystem::path FindTruth(const std::filesystem::path& truth_path,
                                const std::filesystem::path& image_path);

}  // namespace semfoam
