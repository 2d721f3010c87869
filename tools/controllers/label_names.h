// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"

#include <filesystem>
#include <string>

namespace semfoam {

// Applies the names of labels that the user has set in the table "labels" of the labels.json of an
// export, for all later exports and all commands that take names. The first of these sources that
// has a name for a label is used:
//
//   1. the file `labels_path`, where it is not empty: NameLabels
//   (plugin/mask/label_naming.h)
//   2. labels.json in `output_path`, if that is not empty, and
//   3. labels.json beside the foam: names in them that are not the foam's own, where
//      "source_model_xxh64" is the checksum of this foam
//   4. the foam itself
//
// Logs which names were taken from 2 and 3, and warns where these contradict each other or hold
// names that cannot be used. `model` is the content of `foam_path`. Throws UserError where
// `labels_path` cannot be read.
void TakeLabelNames(const std::filesystem::path& foam_path,
                    const std::filesystem::path& output_path,
                    const std::string& labels_path,
                    Model* model);

// Reads the model and applies these names.
Model ReadNamedModel(const std::filesystem::path& foam_path,
                     const std::filesystem::path& output_path = {},
                     const std::string& labels_path = {});

// Warns where `labels_path`, if it is not empty, has other names than the labels.json of a finished
// training in `output_path`, which is not changed. Throws UserError as TakeLabelNames does.
void WarnOfOtherNames(const std::filesystem::path& output_path, const std::string& labels_path);

}  // namespace semfoam
