// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/io/surface_export.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/object_surface.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace semfoam {

// A surface to write, with its line of the log and a warning (empty: none).
struct MadeSurface {
  ObjectSurface surface;
  std::string summary;
  std::string warning;
};

// Makes what is written of the closed surface of an object's cells, of `components` connected
// components and with so many far vertices (CountFarVertices).
MadeSurface WithSummary(ObjectSurface cells, int64_t components, int64_t far_vertices);

// As ExportSurfaces, for surfaces that `make` makes, one after the other, of the selected objects.
// Of `scene`, only objects and frames are read. Does not write the glTF file of the scene, which
// would hold all surfaces in memory. CHECKs that the options have no photos.
std::vector<WrittenFile> ExportMadeSurfaces(
    const ExportableScene& scene,
    const std::filesystem::path& output_path,
    const SurfaceExportOptions& options,
    const std::function<MadeSurface(const ObjectInfo&)>& make,
    const std::function<void(const WrittenFile&)>& on_written = nullptr);

}  // namespace semfoam
