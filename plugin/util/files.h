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

// The same with no more than `most_at_once` (> 0) at a time, where each takes much memory.
void ForEachFile(int64_t count, int most_at_once, const std::function<void(int64_t index)>& body);

// The regular files below `folder`, sorted; hidden ones and those in hidden folders left out. Links
// to folders are followed, 16 folders deep at most, which ends loops of links. What cannot be read
// is left out. `folder` must be one.
std::vector<std::filesystem::path> ListFiles(const std::filesystem::path& folder);

// Those of ListFiles whose extension is that of a photo (JPEG, PNG, TIFF, BMP, WebP, PPM), in any
// case.
std::vector<std::filesystem::path> ListPhotos(const std::filesystem::path& folder);

// The folder that holds `path`: "a" for both "a/b/" and "a/b".
std::filesystem::path ParentFolder(const std::filesystem::path& path);

}  // namespace semfoam
