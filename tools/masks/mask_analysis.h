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

// What is in a folder of masks, with or without the photos and the model that they belong to.
struct MaskAnalysis {
  MaskedModelPaths paths;
  std::filesystem::path image_folder;  // empty: no photos
  bool has_model = false;
  bool has_predictions = false;  // DEVA's pred.json is there
  MaskPairing pairing;           // as the names say
  std::vector<MaskFile> files;   // [photos]
  std::vector<PhotoSize> sizes;  // [photos] of the photo or its camera; the mask's without either
  // The masks that can be used, by photo. Labels have their names. Without a model the corrected
  // labels are the given ones.
  MaskedPhotos photos;
  CoverageSurvey coverage;
  std::vector<SuspiciousPhoto> suspicious;
  std::string names_warning;  // NameCorrectedLabels
};

// Photos are the model's registered ones; without a model, the files in `image_folder`; without
// that, one for each mask, named like it. Masks that cannot be read or have another aspect than
// their photo are findings, not errors. Throws UserError where the model or the labels file is
// damaged, and as PairMasks and LoadMaskedPhotos do for the whole set.
MaskAnalysis AnalyzeMasks(const MaskedModelPaths& paths,
                          const std::filesystem::path& image_folder,
                          const MaskOptions& masks);

// One line of a finding, for people: "id 9 (ball) is 6 (mug): 14 points".
std::string DescribeFinding(const MaskAnalysis& analysis, const MaskFinding& finding);

// The report for people, line by line; long lists are cut, and say so.
std::vector<std::string> MaskReportLines(const MaskAnalysis& analysis);

// The same, complete, as JSON.
std::string MaskReportJson(const MaskAnalysis& analysis);

}  // namespace semfoam
