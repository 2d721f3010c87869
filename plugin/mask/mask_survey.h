// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ids.h"
#include "plugin/mask/masked_photos.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Surveys the files of a set of masks, and how much of the photos their ids cover.

// Form of a mask file.
struct MaskFile {
  // "8-bit grey", "8-bit palette", "24-bit colour"; empty where it is unreadable.
  std::string format;
  PhotoSize size;
  // Reason why it is unreadable: a sentence whose subject is the mask.
  std::string error;
};

// Decodes every mask, in parallel. Returns one for each of `masks`; an empty one for an empty path.
std::vector<MaskFile> SurveyMasks(const std::vector<std::filesystem::path>& masks);

// Coverage of one id of the masks.
struct IdSurvey {
  // Class of MaskedPhotos::given.
  ClassIndex given_class{0};
  // Photos that have the id, ascending.
  std::vector<int32_t> views;
  // Share of these photos' pixels that have the id, 0..1: the least, the median (the upper one of
  // two) and the most.
  double least = 0;
  double median = 0;
  double most = 0;
};

struct CoverageSurvey {
  // One for each class but that of id 0, ascending by id.
  std::vector<IdSurvey> ids;
  // [views] Share of the photo that is 0; NaN without a mask.
  std::vector<double> unlabelled;
};

// Surveys the masks as they are given, at the records' size.
CoverageSurvey SurveyCoverage(const MaskedPhotos& photos);

}  // namespace semfoam
