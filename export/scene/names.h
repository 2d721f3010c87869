// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ids.h"

#include <array>
#include <cstdint>
#include <string>

namespace semfoam {

// Returns the name for display: the label's own, or "label_<id>" if it has none.
std::string DisplayName(LabelId id, const std::string& name);

// Returns the name for files, of [A-Za-z0-9_-] only and at most 100 characters: every other
// character (a UTF-8 sequence is one) is replaced by '_'. A name without any letter or digit left
// is replaced by "label_<id>".
std::string SanitizedName(LabelId id, const std::string& name);

// Returns "<id>_<sanitised name>", which is unique because ids are.
std::string FileStem(LabelId id, const std::string& name);

// Returns a name as text for files: bytes that are not UTF-8 are replaced by U+FFFD, control
// characters (such as line breaks) by spaces.
std::string OneLine(const std::string& name);

// Returns the colour of a label in pictures and tables, 8-bit display values: HSL with hue (id *
// 1.6180339887) mod 1 (the golden ratio keeps consecutive ids apart), saturation 0.5 for even and 1
// for odd ids, lightness 0.5; black for id 0.
std::array<uint8_t, 3> LabelColor(LabelId id);

}  // namespace semfoam
