// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask/mask_findings.h"
#include "plugin/mask/mask_pairing.h"
#include "plugin/mask/mask_survey.h"
#include "tools/options/mask_options.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// The content of a folder of masks, with or without their photos and model.
struct MaskAnalysis {
  MaskedModelPaths paths;
  // Empty: no photos.
  std::filesystem::path image_folder;
  bool has_model = false;
  // Whether DEVA's pred.json exists.
  bool has_predictions = false;
  // The masks by the photos' names.
  MaskPairing pairing;
  // [photos]
  std::vector<MaskFile> files;
  // [photos] Size of the photo or its camera; without either, that of the mask.
  std::vector<PhotoSize> sizes;
  // The usable masks, with named labels. Without a model the corrected labels are the original
  // ones.
  MaskedPhotos photos;
  CoverageSurvey coverage;
  std::vector<SuspiciousPhoto> suspicious;
  // Result of NameCorrectedLabels.
  std::string names_warning;
};

// Analyses the masks. Photos are the model's registered ones; without a model, the files in
// `image_folder`; without that, one for each mask, with its name. Masks that cannot be read or have
// another aspect than their photo are findings, not errors. Throws UserError where the model or the
// labels file is damaged, and as PairMasks and LoadMaskedPhotos do for the whole set.
MaskAnalysis AnalyzeMasks(const MaskedModelPaths& paths,
                          const std::filesystem::path& image_folder,
                          const MaskOptions& masks);

// Returns a description of a finding in one line: "id 9 (ball) is 6 (mug): 14 points".
std::string DescribeFinding(const MaskAnalysis& analysis, const MaskFinding& finding);

// Returns the report in readable lines; long lists are shortened, with a note.
std::vector<std::string> MaskReportLines(const MaskAnalysis& analysis);

// Returns the complete report as JSON.
std::string MaskReportJson(const MaskAnalysis& analysis);

}  // namespace semfoam
