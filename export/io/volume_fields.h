// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// The quantity in a grid of a volume, and the grid's name.
struct VolumeField {
  // "density", "color", "label", "confidence" or "surface".
  std::string quantity;
  // Name of the grid (GridNames).
  std::string grid_name;
};

// Returns the fields of the .vdb at `path`, in the order of the quantities above, from its grids'
// metadata (kQuantityKey), without loading voxels. Returns nothing where there is no file, or where
// the metadata have another model's checksum (kSourceModelKey) than `source_checksum`, unless that
// is empty. Throws UserError when the file is no volume that can be read.
std::vector<VolumeField> ReadVolumeFields(const std::filesystem::path& path,
                                          const std::string& source_checksum = {});

// Key of the quantity in a grid's metadata.
inline constexpr char kQuantityKey[] = "quantity";

}  // namespace semfoam
