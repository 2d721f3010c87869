// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/mask_recognition.h"
#include "plugin/mask_import/region_numbering.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Converts masks of any known format into 16-bit PNGs of label ids, one for each photo, and
// labels.json and region_features.json beside them, as trainings read them.

// One label, for the user.
struct ImportedLabel {
  int32_t id = 0;
  std::string name;
  // Photos in which it has pixels.
  int num_photos = 0;
};

struct MaskImport {
  // "COCO annotations".
  std::string format;
  int num_photos = 0;
  // Photos with a mask.
  int num_masks = 0;
  // Those of them that are grown from strokes, and the share of their pixels that have a label.
  int num_grown = 0;
  double grown_share = 0;
  // How masks were matched with photos (PhotoMatching::how).
  std::string matched_how;
  // Whether ids mean nothing from photo to photo (NumberedRegions).
  bool are_independent = false;
  // Labels with pixels, ascending by id.
  std::vector<ImportedLabel> labels;
  // Masks without a photo, by their names.
  std::vector<std::string> without_photo;
  // Parts of sentences on what was left out.
  std::vector<std::string> left_out;
  // A sentence each.
  std::vector<std::string> warnings;
};

// Names of the photos below a folder, sorted. Throws UserError where there are none.
std::vector<std::string> PhotoNames(const std::filesystem::path& image_path);

// Converts `recognized` into `output_path`, which must exist: <photo>.png for each photo with a
// mask (NamesForMasks), labels.json and, where the format tells of classes and scores more than
// names of labels do, region_features.json. Pictures are read and written in parallel, so that one
// for each thread is in memory; those with strokes are grown before (GrowMarks), and labels.json
// says that id 0 is unlabelled (SaysZeroIsUnlabelled). All files are written before the first of
// them is moved to its place. Throws UserError, one sentence naming the file: masks that are
// damaged, of another aspect than their photo, or of no photo; files in the folder that would be
// replaced and are not of an import.
MaskImport ImportMasks(const RecognizedMasks& recognized,
                       const std::filesystem::path& image_path,
                       const std::vector<std::string>& photo_names,
                       SameName same_name,
                       const std::filesystem::path& output_path);

// The lines of a summary for the user.
std::vector<std::string> DescribeImport(const MaskImport& import);

}  // namespace semfoam
