// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

namespace semfoam {

// Calls body(0) .. body(count - 1) in parallel. Where some throw UserError, rethrows the one with
// the lowest index, whatever the threads did, once all have ended.
void ForEachFile(int64_t count, const std::function<void(int64_t index)>& body);

// The regular files below `folder`, sorted; hidden ones and those in hidden folders left out. Links
// to folders are followed, 16 folders deep at most, which ends loops of links. What cannot be read
// is left out. `folder` must be one.
std::vector<std::filesystem::path> ListFiles(const std::filesystem::path& folder);

}  // namespace semfoam
