// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>

namespace semfoam {

// The tables that come with masks. Both throw UserError, one sentence that names the file, where it
// cannot be read or has another form.

// The ids that DEVA lists in pred.json: annotations[].segments_info[].id, 0 to 0xffffff.
std::set<uint32_t> ReadPredictedIds(const std::filesystem::path& file);

// The names by the masks' ids of a labels.json: {"labels": {"7": "mug"}}. Other keys beside
// "labels" are left alone: what an export writes is a valid input.
std::map<uint32_t, std::string> ReadLabelNames(const std::filesystem::path& file);

}  // namespace semfoam
