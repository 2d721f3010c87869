// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

namespace semfoam {

// Calls body(0) .. body(count - 1) in parallel. Where some throw UserError, rethrows, after all
// have ended, the one with the lowest index, so that the error does not depend on the threads.
void ForEachFile(int64_t count, const std::function<void(int64_t index)>& body);

// Does the same with at most `most_at_once` (> 0) calls at a time, for calls that take much memory.
void ForEachFile(int64_t count, int most_at_once, const std::function<void(int64_t index)>& body);

// Returns the regular files below `folder`, sorted, without hidden files and hidden folders.
// Follows links to folders, to a depth of 16 folders, which ends loops of links. Leaves out folders
// that cannot be read. `folder` must exist.
std::vector<std::filesystem::path> ListFiles(const std::filesystem::path& folder);

// Returns the files of ListFiles that have the extension of a photo (JPEG, PNG, TIFF, BMP, WebP,
// PPM), in upper or lower case.
std::vector<std::filesystem::path> ListPhotos(const std::filesystem::path& folder);

// Returns the folder that holds `path`: "a" for both "a/b/" and "a/b".
std::filesystem::path ParentFolder(const std::filesystem::path& path);

}  // namespace semfoam
