// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

namespace semfoam {

// What a command reads it never writes over. Throws UserError, naming the file, when one of
// `outputs`, files about to be written, is one of `inputs`, by whatever path or link; files that
// are not there are neither. To be called before the first of them is written.
void RequireInputsStay(const std::vector<std::filesystem::path>& inputs,
                       const std::vector<std::filesystem::path>& outputs);

}  // namespace semfoam
