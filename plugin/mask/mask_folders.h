// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace semfoam {

// Where instance masks are looked for, and what is there.

// The folder of the masks that `workspace` holds: object_mask/, then Annotations/; empty where it
// has neither.
std::filesystem::path FindMaskFolder(const std::filesystem::path& workspace);

// All PNGs below the folder by their name in it, "/" between folders, with ".png" for ".PNG".
std::map<std::string, std::filesystem::path> ListMasks(const std::filesystem::path& folder);

// Other folders in `workspace` that hold PNGs and whose names speak of masks or annotations, such
// as masks/: FindMaskFolder does not look there. Sorted.
std::vector<std::filesystem::path> UnusedMaskFolders(const std::filesystem::path& workspace);

// The sentence about a folder in which no mask was found, without its full stop: "W/object_mask:
// holds no mask but 16 .jpg files, where a PNG for each photo would be right". What there is is
// counted by extension.
std::string NoMaskIn(const std::filesystem::path& folder);

// A sentence for the user where no photo has a mask though the user named no folder: `mask_folder`,
// which FindMaskFolder found in one of `workspaces`, holds none; or it is empty, and they hold
// UnusedMaskFolders. Empty where they hold nothing of the kind.
std::string NoMasksWarning(const std::filesystem::path& mask_folder,
                           const std::vector<std::filesystem::path>& workspaces);

}  // namespace semfoam
