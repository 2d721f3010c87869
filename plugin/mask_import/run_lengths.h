// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/pixel_runs.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace semfoam {

// Decodes run lengths of masks, as COCO and SAM write them: lengths of runs of 0 and 1 in turn, 0
// first, over the pixels column by column. The compressed form writes each length, less the one two
// places before it from the fourth on, as groups of five bits, the least significant ones first, in
// characters from '0' on; 32 marks that another group follows, and 16 of the last group is the sign
// (the format of pycocotools, maskApi.c).

// Either lengths, or what is wrong with them, as a part of a sentence: "run 3 is negative".
struct RunLengths {
  std::vector<int64_t> lengths;
  std::string error;
};

// Decodes the compressed form.
RunLengths DecodeRunLengths(std::string_view text);

// Encodes lengths, none of which is negative.
std::string EncodeRunLengths(const std::vector<int64_t>& lengths);

// Returns the pixels of the runs of 1; nothing where the lengths do not add up to the picture.
std::optional<PixelRuns> RunsOfLengths(const std::vector<int64_t>& lengths, const PhotoSize& size);

// Returns the lengths of a region's runs.
std::vector<int64_t> LengthsOfRuns(const PixelRuns& runs, const PhotoSize& size);

}  // namespace semfoam
