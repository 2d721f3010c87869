// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"

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

}  // namespace semfoam
