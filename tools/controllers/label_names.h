// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"

#include <filesystem>
#include <string>

namespace semfoam {

// The names of a foam's labels. A user may change them in the table "labels" of the labels.json
// that an export wrote; from then on the exports, and the commands that take names, use them. Of
// several sources the first that has a name for a label decides:
//
//   1. the file `labels_path`, where it is not empty: NameLabels
//   (plugin/mask/label_naming.h)
//   2. labels.json in `output_path`, if that is not empty, and
//   3. labels.json beside the foam: names in them that are not the foam's own, where
//      "source_model_xxh64" says that they are of this foam
//   4. the foam itself
//
// Logs which names were taken from 2 and 3, and warns where they contradict each other or hold
// names that cannot be taken. `model` is what `foam_path` holds. Throws UserError where
// `labels_path` cannot be read.
void TakeLabelNames(const std::filesystem::path& foam_path,
                    const std::filesystem::path& output_path,
                    const std::string& labels_path,
                    Model* model);

// The model, with these names.
Model ReadNamedModel(const std::filesystem::path& foam_path,
                     const std::filesystem::path& output_path = {},
                     const std::string& labels_path = {});

// A finished training in `output_path` stays as it is: warns where `labels_path`, if it is not
// empty, has other names than the labels.json there. Throws UserError as TakeLabelNames.
void WarnOfOtherNames(const std::filesystem::path& output_path, const std::string& labels_path);

}  // namespace semfoam
