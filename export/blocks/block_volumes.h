// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/blocks/block_scene.h"
#include "export/io/volume_export.h"
#include "export/scene/exportable_scene.h"
#include "export/volume/volume_extent.h"
#include "export/volume/volume_options.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace semfoam {

// Makes the volumes of a foam in blocks, in three steps: the extents of all blocks, by which the
// volumes are planned; their voxels; and the files, of which one at a time is put together.
class BlockVolumes {
 public:
  // Plans the volumes of the scene and of the selected `objects` (FindBlockObjects). Keeps its
  // pieces in `folder`, and references to `objects` and `options`.
  BlockVolumes(const ExportableScene& objects,
               const VolumeExportOptions& options,
               size_t num_blocks,
               std::filesystem::path folder);

  // Step 1: adds the extents of a block, after TakeObjects. Throws UserError where a file cannot be
  // written.
  void AddExtents(const BlockScene& block, size_t number) const;
  // Chooses lattices and boxes, when all blocks have been added. Throws UserError for a volume that
  // would be too large; its message names a path below `output_path`.
  void Plan(const std::filesystem::path& output_path);

  // Step 2: adds the voxels of a block, after TakeObjects: those whose centres lie in its cells.
  void AddVoxels(const BlockScene& block, size_t number) const;

  // Step 3.
  size_t NumVolumes() const { return plans_.size(); }
  // Joins the voxels of all blocks in a volume, writes its files below `output_path`, and returns
  // them. Needs the surface of an object once more (WriteSurfacePieces in the same folder).
  std::vector<WrittenFile> Write(size_t volume, const std::filesystem::path& output_path) const;

 private:
  struct PlannedVolume {
    // Relative to the output folder.
    std::string path;
    // Index into objects_.objects; none: the scene.
    std::optional<size_t> object;
    // Without cells.
    Volume volume;
  };

  std::filesystem::path PiecePath(const std::string& what, size_t volume, size_t block) const;
  // Returns the volume with its cells in a block.
  Volume VolumeIn(const BlockScene& block, const PlannedVolume& plan) const;

  const ExportableScene& objects_;
  const VolumeExportOptions& options_;
  const size_t num_blocks_;
  const std::filesystem::path folder_;
  // The scene, then the objects.
  std::vector<PlannedVolume> plans_;
};

}  // namespace semfoam
