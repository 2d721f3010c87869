// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "tests/plugin/test_util.h"

namespace semfoam {

// Writes a 4 x 2 mask of 8-bit grey ids.
inline void WriteGrey(const std::filesystem::path& path, const std::vector<uint8_t>& ids) {
  WritePng(path, 4, 2, 8, PNG_COLOR_TYPE_GRAY, ids);
}

}  // namespace semfoam
