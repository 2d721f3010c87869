// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// What a command reads it never writes over. Throws UserError, naming the file, when one of
// `outputs`, files about to be written, is one of `inputs`, by whatever path or link; files that
// are not there are neither. To be called before the first of them is written. `option` is the one
// that says where `outputs` go.
void CheckNoInputOverwrite(const std::vector<std::filesystem::path>& inputs,
                           const std::vector<std::filesystem::path>& outputs,
                           const std::string& option = "--output_path");

// Images of others are not written over either. Throws UserError, naming the file, when one of
// `images`, files about to be written, is there and not written by this program (IsOwnImage). A
// link is: it would be replaced, and what it leads to would stay.
void RequireOwnImages(const std::vector<std::filesystem::path>& images,
                      const std::string& option = "--output_path");

}  // namespace semfoam
