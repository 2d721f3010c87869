// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Ensures that a command does not overwrite its inputs. Throws UserError, naming the file, when one
// of `outputs`, the files about to be written, is one of `inputs`, by any path or link; ignores
// files that do not exist. Must be called before the first of them is written. `field` is the name
// of the option or argument that sets the output path.
void CheckNoInputOverwrite(const std::vector<std::filesystem::path>& inputs,
                           const std::vector<std::filesystem::path>& outputs,
                           const std::string& field = "output_path");

// Ensures that a command overwrites only images of this program. Throws UserError, naming the file,
// when one of `images`, the files about to be written, exists and was not written by this program
// (IsOwnImage). Links may be overwritten: the link is replaced, and its target stays.
void RequireOwnImages(const std::vector<std::filesystem::path>& images,
                      const std::string& field = "output_path");

}  // namespace semfoam
