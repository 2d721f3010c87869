// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photo/photo.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace semfoam {

// Reads the PNG files of masks.

struct MaskHeader {
  PhotoSize size;
  // Whether it stores colours; false: grey values or palette indices.
  bool is_rgb = false;
  bool is_palette = false;
  // Colours of the palette, R + 256 G + 65536 B, by index; empty without one.
  std::vector<uint32_t> palette;
  // Bits of a channel, as stored: 1, 2, 4, 8 or 16.
  int bits = 0;
  // Memory in bytes that ReadMaskRows takes: that of one row, or of all rows where they are
  // interlaced.
  uint64_t decoding_bytes = 0;
};

// Reads the header without decoding a pixel. Throws UserError, one sentence naming the file, when
// it is missing, is no PNG, holds 16-bit colours, which no mask format has, or its header is
// damaged or promises more pixels than the file's bytes could ever hold.
MaskHeader ReadMaskHeader(const std::filesystem::path& path);

// Decodes a whole PNG and calls on_row(header, y, values) for every row from the top one on;
// `values` [width] are the stored values, before any interpretation as colour: the grey value (1 to
// 16 bits, not stretched), the palette index, or R + 256 G + 65536 B. Throws UserError as
// ReadMaskHeader does, when the file is cut or damaged, and when its rows are interlaced and do not
// all fit into memory; also what on_row throws.
MaskHeader ReadMaskRows(
    const std::filesystem::path& path,
    const std::function<void(const MaskHeader& header, int y, std::span<const uint32_t> values)>&
        on_row);

// Does the same, but with the values of the alpha channel where there is one.
MaskHeader ReadAlphaOrIdRows(
    const std::filesystem::path& path,
    const std::function<void(const MaskHeader& header, int y, std::span<const uint32_t> values)>&
        on_row);

// Does the same as ReadMaskRows with a PNG in memory; `path` is for messages.
MaskHeader ReadMaskRows(
    const std::filesystem::path& path,
    std::string_view png,
    const std::function<void(const MaskHeader& header, int y, std::span<const uint32_t> values)>&
        on_row);

// All rows of a mask.
struct MaskPng {
  int width = 0;
  int height = 0;
  bool is_rgb = false;
  // [height][width], row-major.
  std::vector<uint32_t> values;
};

// Reads a mask as ReadMaskRows does, as a whole. Throws UserError also when the values do not fit
// into memory.
MaskPng ReadMaskPng(const std::filesystem::path& path);

}  // namespace semfoam
