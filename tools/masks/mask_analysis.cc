// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/masks/mask_analysis.h"

#include "foam/util/error.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/mask/label_naming.h"
#include "plugin/mask/mask_tables.h"
#include "plugin/mask/point_labels.h"
#include "plugin/util/files.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

std::vector<PhotoRecord> NamedPhotos(const std::vector<fs::path>& files, const fs::path& folder) {
  std::vector<PhotoRecord> photos;
  for (const fs::path& file : files) {
    photos.emplace_back().name = file.lexically_relative(folder).generic_string();
  }
  return photos;
}

// Returns a photo for each mask.
std::vector<PhotoRecord> PhotosOfMasks(const fs::path& mask_folder) {
  if (!fs::is_directory(mask_folder)) return {};  // PairMasks says so
  std::vector<fs::path> masks = ListFiles(mask_folder);
  std::erase_if(masks, [](const fs::path& path) { return path.extension() != ".png"; });
  return NamedPhotos(masks, mask_folder);
}

MaskFinding FileFinding(size_t view, MaskFault fault) {
  MaskFinding finding;
  finding.view = static_cast<int32_t>(view);
  finding.fault = fault;
  return finding;
}

// The sizes that masks are held against, and what is wrong with their files. Leaves in `usable` the
// masks that can be loaded.
std::vector<MaskFinding> CheckFiles(MaskAnalysis* analysis,
                                    std::vector<PhotoRecord>* photos,
                                    MaskPairing* usable) {
  std::vector<MaskFinding> findings;
  const bool has_photos = analysis->has_model || !analysis->image_folder.empty();
  for (size_t i = 0; i < photos->size(); ++i) {
    PhotoRecord& photo = (*photos)[i];
    const MaskFile& file = analysis->files[i];
    if (!has_photos) {
      photo.width = std::max(1, file.size.width);
      photo.height = std::max(1, file.size.height);
    }
    const PhotoSize size = {photo.width, photo.height};
    analysis->sizes.push_back(size);
    if (usable->masks[i].empty()) {
      findings.push_back(FileFinding(i, MaskFault::kNone));
    } else if (!file.error.empty()) {
      findings.push_back(FileFinding(i, MaskFault::kUnreadable));
      usable->masks[i].clear();
    } else if (!SameAspect(file.size, size)) {
      findings.push_back(FileFinding(i, MaskFault::kWrongAspect));
      usable->masks[i].clear();
    }
  }
  return findings;
}

}  // namespace

MaskAnalysis AnalyzeMasks(const MaskedModelPaths& paths,
                          const fs::path& image_folder,
                          const MaskOptions& masks) {
  MaskAnalysis analysis;
  analysis.paths = paths;
  analysis.image_folder = image_folder;
  analysis.has_model = !paths.model_folder.empty();
  analysis.has_predictions = !FindPredictions(paths.mask_folder).empty();
  std::optional<Reconstruction> model;
  std::vector<PhotoRecord> photos;
  if (analysis.has_model) {
    model = ReadReconstruction(paths.model_folder);
    photos = RegisteredPhotos(*model);
  } else if (!image_folder.empty()) {
    photos = NamedPhotos(ListPhotos(image_folder), image_folder);
    ForEachFile(static_cast<int64_t>(photos.size()), [&](int64_t i) {
      const PhotoSize size = ReadPhotoSize(image_folder / photos[i].name);
      photos[i].width = size.width;
      photos[i].height = size.height;
    });
  } else {
    photos = PhotosOfMasks(paths.mask_folder);
  }
  std::vector<std::string> names;
  names.reserve(photos.size());
  for (const PhotoRecord& photo : photos) names.push_back(photo.name);
  analysis.pairing = PairMasks(paths.mask_folder, names);
  RequireMasks(analysis.pairing, paths.mask_folder);
  analysis.files = SurveyMasks(analysis.pairing.masks);
  MaskPairing usable = analysis.pairing;
  std::vector<MaskFinding> findings = CheckFiles(&analysis, &photos, &usable);

  analysis.photos = LoadMaskedPhotos(model ? &*model : nullptr,
                                     std::move(photos),
                                     usable,
                                     paths.mask_folder,
                                     masks.Zero(),
                                     masks.Consistency());
  const bool names_are_given = !masks.labels_path.empty();
  analysis.names_warning = NameCorrectedLabels(paths.labels_file,
                                               names_are_given,
                                               analysis.photos.consistency,
                                               analysis.photos.given.labels,
                                               &analysis.photos.labels);
  // Names that the user gave for the new ids of independent masks are not those of the old ones.
  const bool names_are_new =
      names_are_given && analysis.photos.consistency.used == MaskConsistency::kIndependent;
  if (!paths.labels_file.empty() && !names_are_new) {
    NameLabels(paths.labels_file, &analysis.photos.given.labels);
  }
  analysis.coverage = SurveyCoverage(analysis.photos);
  const std::vector<MaskFinding> by_tracks =
      FindMaskFaults(analysis.photos, LabelPoints(analysis.photos));
  findings.insert(findings.end(), by_tracks.begin(), by_tracks.end());
  analysis.suspicious = RankPhotos(findings);
  return analysis;
}

}  // namespace semfoam
