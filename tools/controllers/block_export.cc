// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/block_export.h"

#include "export/blocks/block_export.h"
#include "export/blocks/block_objects.h"
#include "export/blocks/block_scene.h"
#include "export/scene/object_selection.h"
#include "foam/util/error.h"
#include "tools/controllers/block_run.h"
#include "tools/controllers/export_frame.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/export_surfaces.h"
#include "tools/controllers/export_volumes.h"
#include "tools/controllers/label_names.h"
#include "tools/controllers/left_out_log.h"
#include "tools/support/memory_task.h"

#include <optional>
#include <utility>
#include <vector>

namespace semfoam {
namespace {

// The opened blocks and their objects.
struct OpenedBlocks {
  FoamBlocks blocks;
  std::string checksum;
  std::optional<BlockScenes> scenes;
  ExportableScene objects;
};

// Opens the blocks and finds their objects. Throws as ExportBlockMeshes does.
void Open(const BlockExport& what, const std::set<ExportFormat>& formats, OpenedBlocks* opened) {
  if (NeedsSurface(what.frame)) {
    throw FieldError("level",
                     " by a surface needs all cells at once, and blocks are read one at a time; "
                     "cameras, or merging the blocks, would be right.");
  }
  opened->blocks = OpenBlocks(what.blocks_path);
  Model* const run = &opened->blocks.run;
  const std::filesystem::path run_path = RunPath(what.blocks_path);
  if (IsWhole(*run)) {
    throw UserError(run_path.string(),
                    ": has no labels, and of a foam in blocks only objects are written; masks in "
                    "the training, or merging the blocks, would be right.");
  }
  opened->checksum = ChecksumOfBlocks(what.blocks_path);
  RequireSameFoam(what.output_path, opened->checksum);
  TakeLabelNames(run_path, what.output_path, what.labels_path, run);
  ExportableSceneOptions options;
  options.transform = FindFrame(*run, what.frame);
  options.components = what.components;
  RequireOneFrame(options.transform, what.output_path, formats, opened->checksum);
  const MemoryTask task("objects are found", "more blocks (scene_splitter)");
  opened->scenes.emplace(opened->blocks, options);
  opened->objects = FindBlockObjects(&*opened->scenes);
  LogLeftOut(opened->objects);
}

}  // namespace

void ExportBlockMeshes(const BlockExport& blocks,
                       const std::set<ExportFormat>& formats,
                       SurfaceExportOptions surface) {
  OpenedBlocks opened;
  Open(blocks, formats, &opened);
  surface.objects = FilterObjects(opened.objects, blocks.choice);
  surface.source_checksum = opened.checksum;
  RequireObjects(opened.objects, blocks.blocks_path);
  const std::vector<WrittenFile> files = WriteBlockMeshes(
      &*opened.scenes, &opened.objects, blocks.output_path, formats, std::move(surface));
  WriteLabels(opened.objects, blocks.output_path, {opened.checksum, files});
}

int64_t MemoryOfObjects(int64_t num_sites) {
  // Triangulation, corners, faces and planes of all cells; measured with 0.4 M cells.
  constexpr int64_t kBytesPerSite = 1400;
  return kBytesPerSite * num_sites;
}

void WriteLabelsOfBlocks(const std::filesystem::path& blocks_path,
                         const std::filesystem::path& foam_path) {
  FoamBlocks blocks = OpenBlocks(blocks_path);
  TakeLabelNames(foam_path, {}, {}, &blocks.run);
  ExportableSceneOptions options;
  options.transform = FindFrame(blocks.run, {});
  const FinishedExport finished{ModelChecksum(foam_path), {}, /*is_new_foam=*/true};
  if (IsWhole(blocks.run)) {
    WriteLabels(MakeExportableScene(blocks.run, options), foam_path.parent_path(), finished);
    return;
  }
  BlockScenes scenes(blocks, options);
  const ExportableScene objects = FindBlockObjects(&scenes);
  LogLeftOut(objects);
  WriteLabels(objects, foam_path.parent_path(), finished);
}

void ExportBlockVolumeFiles(const BlockExport& blocks, VolumeExportOptions volume) {
  OpenedBlocks opened;
  Open(blocks, {ExportFormat::kVdb}, &opened);
  volume.objects = FilterObjects(opened.objects, blocks.choice);
  volume.source_checksum = opened.checksum;
  const std::vector<WrittenFile> files =
      WriteBlockVolumes(&*opened.scenes, &opened.objects, blocks.output_path, std::move(volume));
  WriteLabels(opened.objects, blocks.output_path, {opened.checksum, files});
}

}  // namespace semfoam
