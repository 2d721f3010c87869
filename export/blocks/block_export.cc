// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/blocks/block_export.h"

#include "export/blocks/block_surfaces.h"
#include "export/blocks/block_volumes.h"
#include "export/io/made_surfaces.h"
#include "export/scene/object_faces.h"
#include "foam/util/scratch_folder.h"

#include <cstdint>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Describes all objects, selected or not, as labels.json lists all.
void DescribeAll(size_t num_blocks, const std::filesystem::path& folder, ExportableScene* objects) {
  for (size_t index = 0; index < objects->objects.size(); ++index) {
    const JoinedSurface joined = JoinSurface(*objects, index, num_blocks, folder);
    DescribeBySurface(joined.surface, &objects->objects[index]);
  }
}

}  // namespace

std::vector<WrittenFile> ExportBlockSurfaces(
    BlockScenes* scenes,
    ExportableScene* objects,
    const std::filesystem::path& output_path,
    const SurfaceExportOptions& options,
    const std::function<void(const WrittenFile&)>& on_written) {
  CHECK(options.method == SurfaceMethod::kCells);
  CHECK(options.crop.empty());
  const ScratchFolder folder(output_path);
  const size_t num_blocks = scenes->NumBlocks();
  for (size_t b = 0; b < num_blocks; ++b) {
    BlockScene block = scenes->Make(b);
    TakeObjects(*objects, &block);
    WriteSurfacePieces(block, b, folder.path());
  }
  DescribeAll(num_blocks, folder.path(), objects);
  const auto make = [&](const ObjectInfo& object) {
    const auto index = static_cast<size_t>(&object - objects->objects.data());
    JoinedSurface joined = JoinSurface(*objects, index, num_blocks, folder.path());
    const int64_t far = CountFarDistances(joined.distances);
    return WithSummary(std::move(joined.surface), object.components, far);
  };
  return ExportMadeSurfaces(*objects, output_path, options, make, on_written);
}

std::vector<WrittenFile> ExportBlockVolumes(
    BlockScenes* scenes,
    ExportableScene* objects,
    const std::filesystem::path& output_path,
    const VolumeExportOptions& options,
    const std::function<void(const WrittenFile&)>& on_written) {
  const ScratchFolder folder(output_path);
  const size_t num_blocks = scenes->NumBlocks();
  BlockVolumes volumes(*objects, options, num_blocks, folder.path());
  for (size_t b = 0; b < num_blocks; ++b) {
    BlockScene block = scenes->Make(b);
    TakeObjects(*objects, &block);
    WriteSurfacePieces(block, b, folder.path());
    volumes.AddExtents(block, b);
  }
  DescribeAll(num_blocks, folder.path(), objects);
  volumes.Plan(output_path);
  for (size_t b = 0; b < num_blocks; ++b) {
    BlockScene block = scenes->Make(b);
    TakeObjects(*objects, &block);
    volumes.AddVoxels(block, b);
  }
  std::vector<WrittenFile> files;
  for (size_t v = 0; v < volumes.NumVolumes(); ++v) {
    for (WrittenFile& file : volumes.Write(v, output_path)) {
      files.push_back(std::move(file));
      if (on_written) on_written(files.back());
    }
  }
  return files;
}

}  // namespace semfoam
