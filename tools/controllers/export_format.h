// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"

#include <set>

namespace semfoam {

// The formats that an export can write: volumes as OpenVDB, surfaces as OpenMesh, PLY, OBJ, binary
// glTF and text USD. Their names are the extensions of the files.
enum class ExportFormat { kVdb, kOm, kPly, kObj, kGlb, kUsda };
inline constexpr EnumName<ExportFormat> kExportFormatNames[] = {{ExportFormat::kVdb, "vdb"},
                                                                {ExportFormat::kOm, "om"},
                                                                {ExportFormat::kPly, "ply"},
                                                                {ExportFormat::kObj, "obj"},
                                                                {ExportFormat::kGlb, "glb"},
                                                                {ExportFormat::kUsda, "usda"}};

// Returns whether any of the formats holds textures.
inline bool TakesTextures(const std::set<ExportFormat>& formats) {
  return formats.count(ExportFormat::kObj) != 0 || formats.count(ExportFormat::kGlb) != 0 ||
         formats.count(ExportFormat::kUsda) != 0;
}

}  // namespace semfoam
