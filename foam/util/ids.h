// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/host_device.h"

#include <cstdint>
#include <ostream>

namespace semfoam {

// Distinct types for the three integers that identify an object, so that the compiler refuses one
// in the place of another. Each has the size and the order of the integer in files and messages,
// which Value returns.

// The id of an object in the masks: a pixel's grey value, palette index or colour
// (plugin/mask/mask_classes.h).
enum class MaskId : uint32_t {};
// The id of pixels without a tracked object.
inline constexpr MaskId kZeroMaskId{0};

// The id of a label in renders and exports, 1 to 65535: the id in the masks if all of these fit,
// else a new one (Label).
enum class LabelId : int32_t {};
// The id of pixels and cells without an object.
inline constexpr LabelId kNoObject{0};

// The index of a class of the classifier: a row of its weights and a place in Model::labels, or in
// the labels of a set of masks before training. Kernels and the loops that cast rays hold it as
// int32_t.
enum class ClassIndex : int32_t {};
// The class of pixels and cells without a class.
inline constexpr ClassIndex kUnlabelled{-1};

constexpr uint32_t Value(MaskId id) { return static_cast<uint32_t>(id); }
constexpr int32_t Value(LabelId id) { return static_cast<int32_t>(id); }
SEMFOAM_HOST_DEVICE constexpr int32_t Value(ClassIndex c) { return static_cast<int32_t>(c); }

inline std::ostream& operator<<(std::ostream& out, MaskId id) { return out << Value(id); }
inline std::ostream& operator<<(std::ostream& out, LabelId id) { return out << Value(id); }
inline std::ostream& operator<<(std::ostream& out, ClassIndex c) { return out << Value(c); }

}  // namespace semfoam
