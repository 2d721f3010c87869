// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ids.h"

#include <array>
#include <cstdint>
#include <string>

namespace semfoam {

// The name that people see: the label's own, or "label_<id>" where it has none.
std::string DisplayName(LabelId id, const std::string& name);

// The name that files carry, of [A-Za-z0-9_-] only and at most 100 characters: every other
// character (UTF-8: one, however many bytes) becomes '_'. A name without a single letter or digit
// left says nothing; "label_<id>" stands in for it.
std::string SanitizedName(LabelId id, const std::string& name);

// "<id>_<sanitised name>": unique because the ids are.
std::string FileStem(LabelId id, const std::string& name);

// A name as text for files: bytes that are no UTF-8 become U+FFFD, control characters (a line
// break, say) become spaces.
std::string OneLine(const std::string& name);

// The colour of a label in pictures and tables, 8-bit display values: HSL with hue (id
// * 1.6180339887) mod 1 (the golden ratio keeps consecutive ids apart), saturation 0.5 for even and
// 1 for odd ids, lightness 0.5; black for id 0.
std::array<uint8_t, 3> LabelColor(LabelId id);

}  // namespace semfoam
