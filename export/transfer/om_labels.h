// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/transfer/polygon_mesh.h"

#include <filesystem>
#include <string_view>
#include <vector>

namespace semfoam {

// Whether `head`, the first bytes of a file, is that of an .om file, OpenMesh's own format.
bool IsOm(std::string_view head);

// Reads the vertices and faces of an .om file, versions 1 and 2 (OpenMesh/Core/IO/OMFormat.hh), and
// skips the rest. OpenMesh itself fails an assertion on damaged files, and allocates memory by
// unchecked counts; this function takes memory in proportion to the file. A corner that is no index
// is kNoVertex, and others are not checked. Throws UserError, one sentence naming the file, where
// it cannot be read, is of another kind, ends too early, or has faces whose edges do not close.
PolygonMesh ReadOmPolygonMesh(const std::filesystem::path& path);

// Copies the .om file `input` to `output` and gives its vertices and faces the properties "label"
// (int32_t) and "confidence" (float), which OpenMesh restores as it does those of WriteOm; replaces
// properties of these names. Everything else stays as it is, byte for byte and in order. Throws
// UserError as ReadOmPolygonMesh does, or where `output` cannot be written.
void CopyOmWithLabels(const std::filesystem::path& input,
                      const std::filesystem::path& output,
                      const std::vector<SurfaceLabel>& vertex_labels,
                      const std::vector<SurfaceLabel>& face_labels);

}  // namespace semfoam
