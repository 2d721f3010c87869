// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace semfoam {

// Finds the folder of the instance masks, and reports the contents of folders without masks.

// Returns the folder of the masks that `workspace` holds: object_mask/, then Annotations/; empty
// where it has neither.
std::filesystem::path FindMaskFolder(const std::filesystem::path& workspace);

// Returns all PNGs below the folder by their name in it, "/" between folders, with ".png" for
// ".PNG".
std::map<std::string, std::filesystem::path> ListMasks(const std::filesystem::path& folder);

// Returns the other folders in `workspace` that hold PNGs and whose names contain "mask" or
// "annotation", such as masks/, which FindMaskFolder does not search. Sorted.
std::vector<std::filesystem::path> UnusedMaskFolders(const std::filesystem::path& workspace);

// Returns the sentence about a folder in which no mask was found, without its full stop:
// "W/object_mask: holds no mask but 16 .jpg files, where a PNG for each photo would be right".
// Counts the files by extension.
std::string NoMaskIn(const std::filesystem::path& folder);

// Returns a sentence for the user where no photo has a mask though the user named no folder:
// `mask_folder`, which FindMaskFolder found in one of `workspaces`, holds none; or it is empty, and
// they hold UnusedMaskFolders. Empty where they hold no such folder.
std::string NoMasksWarning(const std::filesystem::path& mask_folder,
                           const std::vector<std::filesystem::path>& workspaces);

}  // namespace semfoam
