// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/mask_importing.h"

#include "plugin/mask/mask_pairing.h"
#include "plugin/mask_import/mask_import.h"

#include <optional>
#include <string>
#include <vector>

#include <glog/logging.h>

namespace semfoam {

void ImportMasksOf(SceneOptions* scene, const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const fs::path& masks = scene->mask_path;
  if (!scene->use_masks || masks.empty() || !fs::is_directory(scene->image_path)) return;
  const std::vector<std::string> photos = PhotoNames(scene->image_path);
  const std::optional<RecognizedMasks> found = FindMasks(masks, photos);
  if (!found) return;
  if (found->format == MaskFormat::kIdPngs && fs::is_directory(masks) &&
      HavePhotos(masks, photos)) {
    return;
  }
  fs::remove_all(folder);
  fs::create_directories(folder);
  const MaskImport import =
      ImportMasks(*found, scene->image_path, photos, SameName::kObjects, folder);
  for (const std::string& line : DescribeImport(import)) LOG(INFO) << line;
  for (const std::string& warning : import.warnings) LOG(WARNING) << warning;
  scene->mask_path = folder;
  if (scene->mask_consistency != MaskConsistency::kAuto) return;
  if (import.are_independent) {
    scene->mask_consistency = MaskConsistency::kIndependent;
  } else if (import.num_grown == import.num_masks) {
    scene->mask_consistency = MaskConsistency::kOff;
  }
}

}  // namespace semfoam
