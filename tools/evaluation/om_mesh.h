// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/evaluation/polygon_soup.h"

#include <filesystem>

namespace semfoam {

// Reads the vertices and faces of an .om file, OpenMesh's own format, versions 1 and 2
// (OpenMesh/Core/IO/OMFormat.hh), and skips the rest. OpenMesh itself fails an assertion on damaged
// files, and allocates memory by unchecked counts; this function takes memory in proportion to the
// file. Throws UserError, one sentence naming the file, where it cannot be read, is of another
// kind, ends too early, or has faces whose edges do not close.
PolygonSoup ReadOmMesh(const std::filesystem::path& path);

}  // namespace semfoam
