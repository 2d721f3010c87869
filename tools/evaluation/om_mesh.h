// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/evaluation/polygon_soup.h"

#include <filesystem>

namespace semfoam {

// Reads an .om file, OpenMesh's own format, as ReadOmPolygonMesh does.
PolygonSoup ReadOmMesh(const std::filesystem::path& path);

}  // namespace semfoam
