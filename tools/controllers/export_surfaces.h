// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/blocks/block_scene.h"
#include "export/io/surface_export.h"
#include "export/scene/exportable_scene.h"
#include "tools/controllers/export_format.h"

#include <filesystem>
#include <set>
#include <vector>

namespace semfoam {

// Writes the surfaces of the objects (ExportSurfaces) into `output_path`, in these formats (kVdb
// has no surfaces). Logs the files, one line for all formats of an object, and returns them; warns
// where the scene has no object. `surface` holds all options except the formats and the creator,
// which is this program and version. Throws UserError as ExportSurfaces does.
std::vector<WrittenFile> WriteMeshes(const ExportableScene& scene,
                                     const std::filesystem::path& output_path,
                                     const std::set<ExportFormat>& formats,
                                     SurfaceExportOptions surface = {});

// As WriteMeshes, for a foam in blocks (ExportBlockSurfaces): writes the exact surfaces of cells,
// one object after the other, without the glTF file of the scene.
std::vector<WrittenFile> WriteBlockMeshes(BlockScenes* scenes,
                                          ExportableScene* objects,
                                          const std::filesystem::path& output_path,
                                          const std::set<ExportFormat>& formats,
                                          SurfaceExportOptions surface);

// As WriteMeshes, for a scene of PrepareWhole (ExportWholeSurface).
std::vector<WrittenFile> WriteWholeMesh(const ExportableScene& scene,
                                        const std::filesystem::path& output_path,
                                        const std::set<ExportFormat>& formats,
                                        SurfaceExportOptions surface = {});

}  // namespace semfoam
