// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/blocks/foam_blocks.h"
#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/frame_choice.h"
#include "export/scene/label_choice.h"
#include "tools/controllers/export_format.h"

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>

namespace semfoam {

// Exports the trained blocks of scene_splitter block by block, without the memory of a merged foam.

// The blocks to export, and what all exports have in common.
struct BlockExport {
  // The output folder of scene_splitter.
  std::filesystem::path blocks_path;
  // See TakeLabelNames.
  std::string labels_path;
  std::filesystem::path output_path;
  LabelChoice choice;
  FrameChoice frame;
  ComponentOptions components;
};

// Writes the surfaces of the objects, of the method `cells`, and labels.json, in which no object
// has photos. `surface` holds the other options, as for WriteMeshes. Throws UserError, before
// anything is written, as OpenBlocks, RequireSameFoam, RequireOneFrame, FilterObjects and
// RequireObjects do; and where the blocks have no labels, or the frame is levelled by a surface,
// which would need all cells.
void ExportBlockMeshes(const BlockExport& blocks,
                       const std::set<ExportFormat>& formats,
                       SurfaceExportOptions surface);

// Writes the volumes of the scene and of the objects, and labels.json. `volume` holds the other
// options, as for WriteVolumes. Throws as ExportBlockMeshes does, and as ExportBlockVolumes.
void ExportBlockVolumeFiles(const BlockExport& blocks, VolumeExportOptions volume);

// Returns the memory, in bytes, that the objects of a foam of `num_sites` cells take that is in
// memory as a whole (PrepareExport), besides the foam.
int64_t MemoryOfObjects(int64_t num_sites);

// Writes labels.json beside `foam_path`, which was just made of the blocks: what PrepareExport
// finds of a whole foam, but as ExportBlockMeshes does, and in the memory of a block. Of blocks
// without labels it lists no objects. Throws as OpenBlocks does.
void WriteLabelsOfBlocks(const std::filesystem::path& blocks_path,
                         const std::filesystem::path& foam_path);

}  // namespace semfoam
