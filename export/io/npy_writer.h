// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace semfoam {

// Rows of float32 of one length.
struct NpyRows {
  int64_t rows = 0;
  // [rows][values.size() / rows]
  std::vector<float> values;

  // Appends a row. CHECKs that it is as long as those before, and not empty.
  void Add(std::span<const float> row);
};

// Writes them as NumPy saves an array (numpy.lib.format, version 1.0; little-endian, C order).
// Throws UserError when the file cannot be written.
void WriteNpy(const std::filesystem::path& path, const NpyRows& array);

}  // namespace semfoam
