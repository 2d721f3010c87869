// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string_view>
#include <utility>
#include <vector>

namespace semfoam {

// Files that belong to a mesh, such as its textures: where each is and where its copy goes.
using CompanionFiles = std::vector<std::pair<std::filesystem::path, std::filesystem::path>>;

// Appends the file that a mesh in `from_folder` names, if it is there and stays below that folder,
// to go to the same place below `to_folder`; each once. Throws UserError where a file is in the way
// there that differs.
void AddCompanionFile(const std::filesystem::path& from_folder,
                      const std::filesystem::path& to_folder,
                      std::string_view name,
                      CompanionFiles* files);

// Copies these files.
void CopyFiles(const CompanionFiles& files);

}  // namespace semfoam
