// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photo.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace semfoam {

// A PNG's stored values, before any interpretation as colour.
struct MaskPng {
  int width = 0;
  int height = 0;
  bool is_rgb = false;  // else grey values or palette indices
  bool is_palette = false;
  int bits = 0;  // of a channel, as stored: 1, 2, 4, 8 or 16
  // Row-major, [height][width]: the grey value (1 to 16 bits, not stretched), the palette index, or
  // R + 256 G + 65536 B.
  std::vector<uint32_t> values;
};

// Decodes a whole PNG. Throws UserError, one sentence naming the file, when it is missing, is no
// PNG, is cut or damaged, or holds 16-bit colours, which no mask format has.
MaskPng ReadMaskPng(const std::filesystem::path& path);

// The size that the file's header says, without decoding. Throws UserError as ReadMaskPng does,
// except for damage behind the header.
PhotoSize ReadMaskSize(const std::filesystem::path& path);

}  // namespace semfoam
