// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Gives labels the names of a labels.json (mask_tables.h).

// Names the labels whose Label::source_id, the masks' own id, has a name in the table
// (LabelName::source_id). Where several names have that id (a foam that had an object inserted has
// two labels of one source id), takes the one whose id is Label::id. Throws what ReadLabelNames
// throws.
void NameLabels(const std::filesystem::path& labels_file, std::vector<Label>* labels);

// Returns a sentence for the user about the file's names whose ids none of `labels` has, which name
// nothing. Empty where there is none. Ignores a name of id 0, which need not be a class.
std::string UnusedNamesWarning(const std::filesystem::path& labels_file,
                               const std::vector<Label>& labels);

}  // namespace semfoam
