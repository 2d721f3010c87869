// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/masks/model_masks.h"

#include "foam/util/error.h"
#include "plugin/mask/mask_pairing.h"

#include <string>
#include <utility>

#include <glog/logging.h>

namespace semfoam {

namespace fs = std::filesystem;

Reconstruction ReadRegistered(const fs::path& model_folder) {
  Reconstruction model = ReadReconstruction(model_folder);
  if (model.images.empty()) {
    throw UserError(model_folder.string(),
                    ": the model has no registered image, where at least one would be right; did "
                    "the reconstruction fail?");
  }
  return model;
}

CorrectedPhotos ReadModelMasks(const Reconstruction& model,
                               const fs::path& mask_folder,
                               LabelZero label_zero,
                               MaskConsistency consistency) {
  std::vector<PhotoRecord> records = RegisteredPhotos(model);
  std::vector<std::string> names;
  names.reserve(records.size());
  for (const PhotoRecord& record : records) names.push_back(record.name);
  const MaskPairing pairing = PairMasks(mask_folder, names);
  RequireMasks(pairing, mask_folder);
  CorrectedPhotos corrected =
      LoadCorrectedPhotos(model, std::move(records), pairing, mask_folder, label_zero, consistency);
  const MaskedPhotos& photos = corrected.photos;
  LOG(INFO) << pairing.NumPaired() << " of " << photos.photos.size() << " photos have a mask, "
            << pairing.unused.size() << " masks unused";
  if (!photos.size_warning.empty()) LOG(WARNING) << photos.size_warning;
  if (consistency != MaskConsistency::kOff) LOG(INFO) << photos.consistency.Line();
  return corrected;
}

std::vector<Label> NamedLabelsOf(const MaskedPhotos& photos,
                                 const fs::path& labels_file,
                                 bool is_given) {
  std::vector<Label> labels = photos.labels;
  const std::string warning =
      NameCorrectedLabels(labels_file, is_given, photos.consistency, photos.given.labels, &labels);
  if (!warning.empty()) LOG(WARNING) << warning;
  return labels;
}

}  // namespace semfoam
