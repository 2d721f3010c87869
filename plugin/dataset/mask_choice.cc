// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/mask_choice.h"

#include "foam/util/error.h"
#include "plugin/mask/mask_folders.h"
#include "plugin/mask/mask_pairing.h"
#include "plugin/mask/mask_png.h"
#include "plugin/mask/mask_tables.h"
#include "plugin/mask_import/photo_matching.h"
#include "plugin/mask_import/region_features.h"
#include "plugin/util/files.h"

#include <map>
#include <string>
#include <vector>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

fs::path MaskFolderOf(const SceneOptions& options) {
  if (!options.use_masks) return {};
  if (!options.mask_path.empty()) return options.mask_path;
  for (const fs::path& workspace : WorkspacesOf(options)) {
    if (const fs::path folder = FindMaskFolder(workspace); !folder.empty()) return folder;
  }
  return {};
}

void PairWithPhotos(ScenePlan* plan) {
  const size_t num_views = plan->photos.size();
  plan->mask_decoding.resize(num_views, 0);
  if (plan->mask_folder.empty()) {
    plan->masks.masks.resize(num_views);
    return;
  }
  std::vector<std::string> names;
  names.reserve(num_views);
  for (const PhotoRecord& photo : plan->photos) names.push_back(photo.name);
  plan->masks = PairMasks(plan->mask_folder, names);
  ForEachFile(static_cast<int64_t>(num_views), [&](int64_t i) {
    const fs::path& mask = plan->masks.masks[i];
    if (!mask.empty()) plan->mask_decoding[i] = ReadMaskHeader(mask).decoding_bytes;
  });
}

}  // namespace

std::vector<fs::path> FindIgnoreFiles(const fs::path& ignore_path,
                                      const std::vector<std::string>& photo_names) {
  if (!fs::is_directory(ignore_path)) {
    throw UserError(ignore_path.string(),
                    ": there is no such folder; it should hold a PNG for each photo whose pixels "
                    "are to be ignored in part.");
  }
  const std::map<std::string, fs::path> files = ListMasks(ignore_path);
  if (files.empty()) throw UserError(NoMaskIn(ignore_path), ".");
  std::vector<std::string> names;
  for (const auto& [name, file] : files) names.push_back(name);
  const PhotoMatching matching = MatchPhotos(ignore_path.string(), names, photo_names);
  std::vector<fs::path> file_of(photo_names.size());
  for (size_t i = 0; i < names.size(); ++i) {
    if (matching.photos[i] >= 0) file_of[matching.photos[i]] = files.at(names[i]);
  }
  return file_of;
}

void ChooseIgnoredPixels(const SceneOptions& options, ScenePlan* plan) {
  plan->ignore_files.resize(plan->photos.size());
  plan->ignore_inverted = options.ignore_inverted;
  if (options.ignore_path.empty()) return;
  std::vector<std::string> photos;
  for (const PhotoRecord& photo : plan->photos) photos.push_back(photo.name);
  plan->ignore_files = FindIgnoreFiles(options.ignore_path, photos);
}

std::vector<fs::path> WorkspacesOf(const SceneOptions& options) {
  std::vector<fs::path> workspaces;
  if (!options.workspace_path.empty()) workspaces.push_back(options.workspace_path);
  workspaces.push_back(ParentFolder(options.image_path));
  return workspaces;
}

void ChooseMasks(const SceneOptions& options, ScenePlan* plan) {
  plan->mask_folder = MaskFolderOf(options);
  plan->masks_are_given = options.use_masks && !options.mask_path.empty();
  plan->labels_are_given = !options.labels_path.empty();
  PairWithPhotos(plan);
  if (plan->masks_are_given) RequireMasks(plan->masks, plan->mask_folder);
  plan->labels_file = FindLabelsFile(options.labels_path, plan->mask_folder);
  plan->features_file = FindRegionFeatures(plan->mask_folder);
  if (options.use_masks && plan->masks.NumPaired() == 0 && plan->labels_are_given) {
    throw UserError(options.labels_path.string(),
                    ": names labels, while there are no masks: ",
                    plan->mask_folder.empty() ? "neither object_mask/ nor Annotations/ is beside "
                                                "the photos; mask_path would name their folder"
                                              : NoMaskIn(plan->mask_folder),
                    ".");
  }
}

}  // namespace semfoam
