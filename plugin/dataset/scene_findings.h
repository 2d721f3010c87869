// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/block_contrast.h"
#include "plugin/dataset/scene_checksums.h"
#include "plugin/dataset/scene_plan.h"
#include "plugin/mask/mask_decoding.h"
#include "plugin/mask/mask_evidence.h"
#include "plugin/photo/photo_survey.h"

#include <filesystem>
#include <optional>
#include <vector>

namespace semfoam {

// What a training looks up in a photo and its mask before it begins: all that decisions on labels,
// masks and light need of them, and the choice of pixels. Where it is known, the training of a
// block need not decode the photos from which it draws nothing.
struct PhotoFindings {
  PhotoSurvey survey;
  BlockContrast contrast;
  MaskContents mask;
  // Empty unless masks are corrected by the tracks.
  IdSamples samples;
};

struct SceneFindings {
  // [photos]
  std::vector<PhotoFindings> photos;
  FileChecksums checksums;
};

// Writes the findings as a checksummed file (foam/train/checkpoint.h). Throws UserError where it
// cannot be written.
void WriteSceneFindings(const std::filesystem::path& path, const SceneFindings& findings);

// Reads the findings in the photos of a plan. Returns nothing where they are of another number of
// photos, or of photos of other sizes; whether they are of the same photos, the checksums tell.
// Throws as Checkpoint where the file is missing or damaged.
std::optional<SceneFindings> ReadSceneFindings(const std::filesystem::path& path,
                                               const ScenePlan& plan);

}  // namespace semfoam
