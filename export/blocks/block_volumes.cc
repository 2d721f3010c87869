// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/blocks/block_volumes.h"

#include "export/blocks/block_surfaces.h"
#include "export/blocks/piece_file.h"
#include "export/io/volume_grids.h"
#include "export/scene/object_selection.h"
#include "export/volume/cell_extents.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include <glog/logging.h>
#include <openvdb/io/File.h>
#include <openvdb/tools/Prune.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// The voxels of a block of 8^3 that lie in an object: bit z of byte 8 x + y.
struct MaskBlock {
  Eigen::Vector3i origin;
  std::array<uint8_t, 64> bits;
};

std::vector<MaskBlock> MaskOf(const std::vector<VoxelBlock>& blocks) {
  std::vector<MaskBlock> mask;
  for (const VoxelBlock& block : blocks) {
    MaskBlock& bits = mask.emplace_back(MaskBlock{block.origin, {}});
    for (int voxel = 0; voxel < 512; ++voxel) {
      if (block.cells[voxel] != kNoCell) {
        bits.bits[voxel / 8] |= static_cast<uint8_t>(1 << voxel % 8);
      }
    }
  }
  return mask;
}

void Write(const fs::path& path, const CellExtents& extents) {
  PieceWriter file(path);
  file.Write(extents.sites);
  file.Write(extents.radii);
  file.Write(extents.volumes);
  file.Write(extents.boxes);
  file.Close();
}

template <typename T>
void Append(const std::vector<T>& values, std::vector<T>* all) {
  all->insert(all->end(), values.begin(), values.end());
}

void Read(const fs::path& path, CellExtents* all) {
  PieceReader file(path);
  Append(file.Read<Eigen::Vector3f>(), &all->sites);
  Append(file.Read<float>(), &all->radii);
  Append(file.Read<double>(), &all->volumes);
  Append(file.Read<Eigen::AlignedBox3d>(), &all->boxes);
}

// Moves the active voxels of `part` into `grid`; none are active in both, but for rounding, and
// then those that are there stay. Null: not wanted, or the first part.
template <typename Grid>
void Merge(const std::vector<openvdb::GridBase::Ptr>& parts,
           const std::string& name,
           typename Grid::Ptr* grid) {
  for (const openvdb::GridBase::Ptr& part : parts) {
    if (part->getName() != name) continue;
    const auto typed = openvdb::gridPtrCast<Grid>(part);
    if (*grid == nullptr) {
      *grid = typed;
    } else {
      (*grid)->tree().merge(typed->tree(), openvdb::MERGE_ACTIVE_STATES);
    }
  }
}

constexpr char kDensity[] = "density", kColor[] = "color", kConfidence[] = "confidence";
constexpr char kLabel[] = "label", kLabelInt32[] = "label_int32";

// Writes voxels for ReadVoxels.
void WriteVoxels(const fs::path& path, const VoxelGrids& voxels) {
  openvdb::GridPtrVec grids;
  const auto add = [&](const char* name, const openvdb::GridBase::Ptr& grid) {
    if (grid == nullptr) return;
    grid->setName(name);
    grids.push_back(grid);
  };
  add(kDensity, voxels.density);
  add(kColor, voxels.color);
  add(kConfidence, voxels.confidence);
  add(kLabel, voxels.label);
  add(kLabelInt32, voxels.label_int32);
  WriteVdb(path, grids, {});
}

// Adds the voxels of a file to `voxels`.
void ReadVoxels(const fs::path& path, VoxelGrids* voxels) {
  openvdb::io::File file(path.string());
  file.open(/*delayLoad=*/false);
  const openvdb::GridPtrVecPtr grids = file.getGrids();
  file.close();
  Merge<openvdb::FloatGrid>(*grids, kDensity, &voxels->density);
  Merge<openvdb::Vec3SGrid>(*grids, kColor, &voxels->color);
  Merge<openvdb::FloatGrid>(*grids, kConfidence, &voxels->confidence);
  Merge<openvdb::FloatGrid>(*grids, kLabel, &voxels->label);
  Merge<openvdb::Int32Grid>(*grids, kLabelInt32, &voxels->label_int32);
}

// Makes leaves of one value, that several blocks have filled, tiles again.
template <typename GridPtr>
void Prune(const GridPtr& grid) {
  if (grid != nullptr) openvdb::tools::prune(grid->tree());
}

}  // namespace

BlockVolumes::BlockVolumes(const ExportableScene& objects,
                           const VolumeExportOptions& options,
                           size_t num_blocks,
                           fs::path folder)
    : objects_(objects), options_(options), num_blocks_(num_blocks), folder_(std::move(folder)) {
  CHECK_EQ(options.Check(), "");
  CHECK(options.supersample == 1 && !options.points);
  InitializeOpenVdb();
  plans_.push_back({"scene.vdb", std::nullopt, {}});
  for (const ObjectInfo* object : SelectObjects(objects, options.objects)) {
    PlannedVolume& plan = plans_.emplace_back();
    plan.path = "objects/" + object->file_stem + ".vdb";
    plan.object = static_cast<size_t>(object - objects.objects.data());
    plan.volume.object = object;
  }
}

fs::path BlockVolumes::PiecePath(const std::string& what, size_t volume, size_t block) const {
  return folder_ / (what + "_" + std::to_string(volume) + "_" + std::to_string(block));
}

Volume BlockVolumes::VolumeIn(const BlockScene& block, const PlannedVolume& plan) const {
  Volume volume = plan.volume;
  if (plan.object) {
    volume.object = &block.scene.objects[*plan.object];
    volume.cells = volume.object->cells;
  } else {
    volume.cells = VolumeCells(block.scene, options_).CellsOfScene();
    std::erase_if(volume.cells, [&](uint32_t cell) { return cell >= block.num_own; });
  }
  return volume;
}

void BlockVolumes::AddExtents(const BlockScene& block, size_t number) const {
  std::vector<uint32_t> of_frame, all(block.num_own);
  for (uint32_t i = 0; i < block.num_own; ++i) {
    all[i] = i;
    if (DeterminesFrame(block.scene, i)) of_frame.push_back(i);
  }
  semfoam::Write(PiecePath("frame", 0, number), ExtentsOf(block.scene, of_frame));
  // They count where no block has any of the former.
  if (of_frame.empty()) semfoam::Write(PiecePath("all", 0, number), ExtentsOf(block.scene, all));
  for (size_t v = 0; v < plans_.size(); ++v) {
    semfoam::Write(PiecePath("extents", v, number),
                   ExtentsOf(block.scene, VolumeIn(block, plans_[v]).cells));
  }
}

void BlockVolumes::Plan(const fs::path& output_path) {
  const auto extents_of = [&](const char* what, size_t volume) {
    CellExtents extents;
    for (size_t b = 0; b < num_blocks_; ++b) Read(PiecePath(what, volume, b), &extents);
    return extents;
  };
  CellExtents of_frame = extents_of("frame", 0);
  if (of_frame.sites.empty()) of_frame = extents_of("all", 0);
  const VolumeFrame frame = MakeVolumeFrame(of_frame, objects_, options_);
  of_frame = {};
  for (size_t v = 0; v < plans_.size(); ++v) {
    Volume& volume = plans_[v].volume;
    const CellExtents extents = extents_of("extents", v);
    if (plans_[v].object) {
      PlaceObject(extents, objects_, frame, options_, &volume);
    } else {
      volume.lattice = frame.lattice;
      volume.box = frame.box;
    }
    CheckVolumeSize(output_path / plans_[v].path, extents, objects_, volume, options_);
  }
}

void BlockVolumes::AddVoxels(const BlockScene& block, size_t number) const {
  const VolumeCells cells(block.scene, options_);
  for (size_t v = 0; v < plans_.size(); ++v) {
    const Volume volume = VolumeIn(block, plans_[v]);
    WriteVoxels(PiecePath("voxels", v, number), cells.Voxels(volume, nullptr));
    if (!plans_[v].object) continue;
    const Eigen::AlignedBox3d region = LevelSetRegion(volume.lattice, volume.box);
    PieceWriter mask(PiecePath("mask", v, number));
    mask.Write(MaskOf(VoxelizeCells(block.scene, volume.cells, volume.lattice, region)));
    mask.Close();
  }
}

std::vector<WrittenFile> BlockVolumes::Write(size_t index, const fs::path& output_path) const {
  const PlannedVolume& plan = plans_[index];
  const Volume& volume = plan.volume;
  const VolumeFinisher finisher(objects_, options_);
  VoxelGrids voxels;
  for (size_t b = 0; b < num_blocks_; ++b) ReadVoxels(PiecePath("voxels", index, b), &voxels);
  Prune(voxels.density);
  Prune(voxels.color);
  Prune(voxels.confidence);
  Prune(voxels.label);
  Prune(voxels.label_int32);
  voxels.num_voxels = static_cast<int64_t>(voxels.density->activeVoxelCount());

  openvdb::FloatGrid::Ptr surface;
  if (plan.object) {
    // By PackBlock of the block, as MakeLevelSet wants them.
    std::map<uint64_t, MaskBlock> mask;
    for (size_t b = 0; b < num_blocks_; ++b) {
      for (const MaskBlock& part : PieceReader(PiecePath("mask", index, b)).Read<MaskBlock>()) {
        const auto [entry, is_new] = mask.emplace(PackBlock(part.origin / 8), part);
        if (is_new) continue;
        for (int k = 0; k < 64; ++k) entry->second.bits[k] |= part.bits[k];
      }
    }
    std::vector<VoxelBlock> inside;
    inside.reserve(mask.size());
    for (const auto& [key, bits] : mask) {
      VoxelBlock& block = inside.emplace_back();
      block.origin = bits.origin;
      for (int voxel = 0; voxel < 512; ++voxel) {
        block.cells[voxel] = bits.bits[voxel / 8] >> voxel % 8 & 1 ? 0 : kNoCell;
      }
    }
    mask.clear();
    const JoinedSurface joined = JoinSurface(objects_, *plan.object, num_blocks_, folder_);
    surface = MakeLevelSet(joined.normalized,
                           joined.surface.triangles,
                           inside,
                           volume.lattice,
                           volume.box,
                           finisher.VoxelSize(volume));
  }
  const VolumeGrids made = finisher.Finish(volume, voxels, surface);
  const LabelId id = plan.object ? volume.object->id : kNoObject;
  std::vector<WrittenFile> files;
  const auto write = [&](const std::string& path, const openvdb::GridPtrVec& grids) {
    finisher.WriteFiles(output_path / path, grids, made.metadata);
    const std::string summary = std::to_string(made.voxels) + " active voxels";
    files.push_back({id, "vdb", path, summary});
    if (!options_.nvdb) return;
    files.push_back({id, "nvdb", fs::path(path).replace_extension(".nvdb").string(), summary});
  };
  write(plan.path, made.grids);
  files.front().warning = finisher.Warning(volume, made.voxels);
  if (made.label_int32 != nullptr) write("scene_labels_int32.vdb", {made.label_int32});
  return files;
}

}  // namespace semfoam
