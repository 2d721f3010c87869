// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <ostream>

namespace semfoam {

// Integers that say which object is meant, each of a type of its own: the compiler refuses one in
// the place of another. They have the size and the order of the integer that files and messages
// hold, which Value returns.

// What a pixel of a mask holds, after interpretation as grey value, palette index or colour
// (plugin/mask/mask_classes.h).
enum class MaskId : uint32_t {};
// Masks hold it where they follow no object.
inline constexpr MaskId kZeroMaskId{0};

constexpr uint32_t Value(MaskId id) { return static_cast<uint32_t>(id); }

inline std::ostream& operator<<(std::ostream& out, MaskId id) { return out << Value(id); }

}  // namespace semfoam
