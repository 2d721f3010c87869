// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/evaluation/polygon_soup.h"

#include <filesystem>

namespace semfoam {

// The vertices and faces of an .om file, OpenMesh's own format, of its versions 1 and 2
// (OpenMesh/Core/IO/OMFormat.hh); all else is read over. OpenMesh itself asserts where such a file
// is damaged, and makes room for whatever its header says; this takes memory in proportion to the
// file. Throws UserError, one sentence naming the file, where it cannot be read, is of another
// kind, ends too early, or has faces whose edges do not close.
PolygonSoup ReadOmMesh(const std::filesystem::path& path);

}  // namespace semfoam
