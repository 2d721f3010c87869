// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// What a grid of one of our volumes holds, and under which name.
struct VolumeField {
  std::string quantity;   // "density", "color", "label", "confidence" or "surface"
  std::string grid_name;  // GridNames renames grids
};

// The fields of the .vdb at `path`, in the order of the quantities above: what its grids' metadata
// say (kQuantityKey), no voxel is loaded. Nothing where there is no file, or where they name
// another model's checksum (kSourceModelKey) than `source_checksum`, unless that is empty. Throws
// UserError when the file is no volume that can be read.
std::vector<VolumeField> ReadVolumeFields(const std::filesystem::path& path,
                                          const std::string& source_checksum = {});

// The key under which a grid's metadata keep what it holds.
inline constexpr char kQuantityKey[] = "quantity";

}  // namespace semfoam
