// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/host_device.h"

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

// The id of a label, 1 to 65535, as renders and exports hold it: that of the masks where it has the
// room, else a new one (Label).
enum class LabelId : int32_t {};
// The label of what is no object, and of pixels and cells without a label.
inline constexpr LabelId kNoObject{0};

// A class of the classifier: a row of its weights, and an index into Model::labels, or into the
// labels of a set of masks that are not a model yet. Kernels and the loops that cast rays keep it
// as int32_t.
enum class ClassIndex : int32_t {};
// The class of pixels and cells that have none.
inline constexpr ClassIndex kUnlabelled{-1};

constexpr uint32_t Value(MaskId id) { return static_cast<uint32_t>(id); }
constexpr int32_t Value(LabelId id) { return static_cast<int32_t>(id); }
SEMFOAM_HOST_DEVICE constexpr int32_t Value(ClassIndex c) { return static_cast<int32_t>(c); }

inline std::ostream& operator<<(std::ostream& out, MaskId id) { return out << Value(id); }
inline std::ostream& operator<<(std::ostream& out, LabelId id) { return out << Value(id); }
inline std::ostream& operator<<(std::ostream& out, ClassIndex c) { return out << Value(c); }

}  // namespace semfoam
