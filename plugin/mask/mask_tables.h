// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace semfoam {

// The tables that come with masks. Both throw UserError, one sentence that names the file, where it
// cannot be read or has another form.

// The ids that DEVA lists in pred.json: annotations[].segments_info[].id, 0 to 0xffffff.
std::set<uint32_t> ReadPredictedIds(const std::filesystem::path& file);

// A line of a table of labels.
struct LabelName {
  uint32_t id = 0;         // of the table
  uint32_t source_id = 0;  // the masks' own
  std::string name;
};

// The names of a labels.json, ascending by id: {"labels": {"7": "mug"}}. An id is the masks' own,
// unless the table says otherwise, as an export's does where it has numbered them anew:
// {"labels": {"7": "mug"}, "source_ids": {"7": 81234}}. Other keys are left alone: what an export
// writes is a valid input.
std::vector<LabelName> ReadLabelNames(const std::filesystem::path& file);

}  // namespace semfoam
