// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask/masked_photos.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// What a mask file is, before any of it is used.
struct MaskFile {
  std::string format;  // "8-bit grey", "8-bit palette", "24-bit colour"; empty where unreadable
  PhotoSize size;
  std::string error;  // why it is unreadable: a sentence whose subject is the mask
};

// Decodes every mask, in parallel. One for each of `masks`; an empty one for an empty path.
std::vector<MaskFile> SurveyMasks(const std::vector<std::filesystem::path>& masks);

// What an id of the masks covers.
struct IdSurvey {
  int32_t given_class = 0;     // of MaskedPhotos::given
  std::vector<int32_t> views;  // the photos that it is in, ascending
  double least = 0;            // its share of these photos' pixels, 0..1: the least,
  double median = 0;           // the median (the upper one of two)
  double most = 0;             // and the most
};

struct CoverageSurvey {
  std::vector<IdSurvey> ids;       // one per class but id 0, ascending by id
  std::vector<double> unlabelled;  // [views] the share of the photo that is 0; NaN without a mask
};

// Of the masks as they are given, at the records' size.
CoverageSurvey SurveyCoverage(const MaskedPhotos& photos);

}  // namespace semfoam
