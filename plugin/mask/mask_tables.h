// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ids.h"

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace semfoam {

// Finds and reads the tables that come with masks: DEVA's list of ids, and the labels' names. Both
// readers throw UserError, one sentence that names the file, where it cannot be read or has another
// form.

// Returns DEVA's pred.json in the mask folder or beside it; empty where there is none.
std::filesystem::path FindPredictions(const std::filesystem::path& mask_folder);

// Returns the ids that DEVA lists in pred.json: annotations[].segments_info[].id, 0 to 0xffffff.
std::set<MaskId> ReadPredictedIds(const std::filesystem::path& file);

// Returns the file of the labels' names: `labels_path` where it is given (throws UserError when
// there is no such file), else labels.json in `mask_folder`, else beside it; empty where there is
// none.
std::filesystem::path FindLabelsFile(const std::filesystem::path& labels_path,
                                     const std::filesystem::path& mask_folder);

// The member of labels.json that says what id 0 of the masks beside it is, and its value where
// these pixels are unlabelled, however many they are.
inline constexpr const char* kLabelZeroKey = "label_zero";
inline constexpr const char* kLabelZeroIgnored = "ignore";

// Whether the labels.json in `mask_folder`, if there is one, says so.
bool SaysZeroIsUnlabelled(const std::filesystem::path& mask_folder);

// A line of a table of labels.
struct LabelName {
  // Id in the table, cast from uint32_t: no label has one above 65535.
  LabelId id = kNoObject;
  // Id in the masks.
  MaskId source_id{0};
  std::string name;
};

// Returns the names of a labels.json, ascending by id: {"labels": {"7": "mug"}}. Ids are those of
// the masks, unless the table has "source_ids", as the table of an export that renumbered them:
// {"labels": {"7": "mug"}, "source_ids": {"7": 81234}}. Other keys are ignored, so that the tables
// of exports can be read.
std::vector<LabelName> ReadLabelNames(const std::filesystem::path& file);

}  // namespace semfoam
