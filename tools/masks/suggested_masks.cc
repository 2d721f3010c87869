// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/masks/suggested_masks.h"

#include "export/scene/names.h"
#include "foam/util/error.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/mask/mask_pairing.h"
#include "plugin/mask/masked_photos.h"
#include "tools/masks/uncertain_cells.h"

#include <cstdio>
#include <unordered_map>
#include <utility>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

std::string Percent(double share) {
  char text[16];
  std::snprintf(text, sizeof(text), "%.0f %%", 100 * share);
  return text;
}

// Returns the model's points with the indices of the photos in `names`.
std::vector<ObservedPoint> PointsOf(const Reconstruction& model,
                                    const std::vector<std::string>& names) {
  std::unordered_map<std::string, int32_t> view_of_name;
  for (size_t i = 0; i < names.size(); ++i) view_of_name[names[i]] = static_cast<int32_t>(i);
  std::unordered_map<uint32_t, int32_t> view_of_image;
  for (const Image& image : model.images) view_of_image[image.id] = view_of_name.at(image.name);
  std::vector<ObservedPoint> points;
  for (const Point3D& point : model.points) {
    if (!point.position.allFinite()) continue;
    ObservedPoint observed{point.position, {}};
    for (const TrackElement& element : point.track) {
      const auto view = view_of_image.find(element.image_id);
      if (view != view_of_image.end()) observed.views.push_back(view->second);
    }
    if (!observed.views.empty()) points.push_back(std::move(observed));
  }
  return points;
}

// Returns which photos have a mask and are `trained_on`, and counts them.
std::vector<bool> FindMasked(const std::filesystem::path& mask_folder,
                             const std::vector<bool>& trained_on,
                             SuggestedMasks* masks) {
  std::vector<bool> has_mask(trained_on.size());
  if (mask_folder.empty()) return has_mask;
  const MaskPairing pairing = PairMasks(mask_folder, masks->photos);
  for (size_t i = 0; i < trained_on.size(); ++i) {
    has_mask[i] = trained_on[i] && !pairing.masks[i].empty();
    masks->num_masks += has_mask[i];
  }
  return has_mask;
}

}  // namespace

SuggestedMasks SuggestMasks(const MaskedModelPaths& paths, int count, int test_every) {
  const Reconstruction model = ReadReconstruction(paths.model_folder);
  SuggestedMasks masks;
  for (const PhotoRecord& photo : RegisteredPhotos(model)) masks.photos.push_back(photo.name);
  std::vector<bool> is_trained_on(masks.photos.size());
  for (size_t i = 0; i < is_trained_on.size(); ++i) {
    is_trained_on[i] = test_every == 0 || i % static_cast<size_t>(test_every) != 0;
  }
  const std::vector<bool> has_mask = FindMasked(paths.mask_folder, is_trained_on, &masks);
  const std::vector<ObservedPoint> points = PointsOf(model, masks.photos);
  if (points.empty()) {
    throw UserError(paths.model_folder.string(),
                    ": the model has no points with tracks, by which photos could be compared.");
  }
  masks.suggestion = SuggestPhotosToMask(points, has_mask, is_trained_on, count);
  return masks;
}

SuggestedMasks SuggestMasks(const Model& model,
                            const std::filesystem::path& foam_path,
                            const std::filesystem::path& mask_folder,
                            int count) {
  if (model.photos.empty()) {
    throw UserError(foam_path.string(),
                    ": has no photos, which could be masked; a foam that was trained on some would "
                    "be right.");
  }
  SuggestedMasks masks;
  masks.by_foam = true;
  std::vector<bool> is_trained_on;
  for (const PhotoRecord& photo : model.photos) {
    masks.photos.push_back(photo.name);
    is_trained_on.push_back(!photo.held_out);
  }
  const std::vector<bool> has_mask = FindMasked(mask_folder, is_trained_on, &masks);
  const UncertainCells cells = FindUncertainCells(model, foam_path);
  masks.suggestion =
      SuggestPhotosToMask(cells.weight, cells.shown_by, has_mask, is_trained_on, count);
  return masks;
}

std::vector<std::string> SuggestionLines(const SuggestedMasks& masks) {
  const std::string scene = masks.by_foam ? "of what the foam is not sure of" : "of the scene";
  std::vector<std::string> lines;
  lines.push_back(masks.num_masks == 0 ? "No photo has a mask"
                                       : std::to_string(masks.num_masks) + " of " +
                                             std::to_string(masks.photos.size()) +
                                             " photos have a mask; they show " +
                                             Percent(masks.suggestion.shown) + " " + scene);
  if (masks.suggestion.photos.empty()) {
    lines.emplace_back("No other photo shows more");
    return lines;
  }
  lines.push_back("Photos to mask next, in this order, and how much " + scene + " is shown then:");
  for (const MaskSuggestion::Photo& photo : masks.suggestion.photos) {
    lines.push_back("  " + OneLine(masks.photos[photo.view]) + "  " + Percent(photo.shown));
  }
  return lines;
}

std::string SuggestionJson(const SuggestedMasks& masks) {
  nlohmann::ordered_json json = {{"version", 1},
                                 {"photos", masks.photos.size()},
                                 {"masks", masks.num_masks},
                                 {"shown", masks.suggestion.shown},
                                 {"suggestions", nlohmann::ordered_json::array()}};
  for (const MaskSuggestion::Photo& photo : masks.suggestion.photos) {
    json["suggestions"].push_back({{"photo", masks.photos[photo.view]}, {"shown", photo.shown}});
  }
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace semfoam
