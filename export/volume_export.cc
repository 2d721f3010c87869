// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/volume_export.h"

#include "export/label_sidecar.h"
#include "foam/error.h"
#include "foam/output_file.h"
#include "foam/parallel.h"
#include "foam/srgb.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <mutex>
#include <numeric>

#include <glog/logging.h>
#include <openvdb/openvdb.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kLeavesPerTask = 64;

void InitializeOpenVdb() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

// Per axis the range between the quantiles q and 1 - q, widened by `fence` times itself, within
// the range of all positions; then `margin` more on every side.
Eigen::AlignedBox3d RobustBox(const ExportableScene& scene,
                              const std::vector<uint32_t>& cells,
                              double q,
                              double fence,
                              double margin) {
  Eigen::AlignedBox3d box;
  if (cells.empty()) return box;
  Eigen::Vector3d low, high;
  std::vector<double> values(cells.size());
  const size_t rank = static_cast<size_t>(q * static_cast<double>(values.size() - 1));
  for (int a = 0; a < 3; ++a) {
    for (size_t k = 0; k < cells.size(); ++k) values[k] = scene.cell_positions[cells[k]][a];
    std::sort(values.begin(), values.end());
    const double from = values[rank];
    const double to = values[values.size() - 1 - rank];
    low[a] = std::max(values.front(), from - fence * (to - from)) - margin;
    high[a] = std::min(values.back(), to + fence * (to - from)) + margin;
  }
  return {low, high};
}

double MedianRadius(const ExportableScene& scene, const std::vector<uint32_t>& cells) {
  std::vector<float> radii;
  radii.reserve(cells.size());
  for (const uint32_t cell : cells) radii.push_back(scene.radius[cell]);
  const auto middle = radii.begin() + radii.size() / 2;
  std::nth_element(radii.begin(), middle, radii.end());
  return *middle;
}

std::vector<uint32_t> CellsOfSceneVolume(const ExportableScene& scene, float min_optical_depth) {
  std::vector<uint32_t> cells;
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    if (scene.density[i] * scene.radius[i] >= min_optical_depth) cells.push_back(i);
  }
  return cells;
}

// About how much of the box the cells fill, normalised frame: cells reach out of it, but not by
// more than their own boxes say.
double FilledVolume(const ExportableScene& scene,
                    const std::vector<uint32_t>& cells,
                    const Eigen::AlignedBox3d& box) {
  double filled = 0;
  for (const uint32_t cell : cells) {
    const Eigen::AlignedBox3d around = CellBox(scene, cell, box);
    if (!around.isEmpty()) filled += std::min(scene.volume[cell], around.volume());
  }
  return std::min(filled, box.volume());
}

// Refuses a volume that would not fit, before any of it is made.
void CheckSize(const fs::path& path,
               const ExportableScene& scene,
               const std::vector<uint32_t>& cells,
               const Eigen::AlignedBox3d& box,
               const VoxelLattice& lattice,
               const VolumeExportOptions& options) {
  if (box.isEmpty()) return;
  const double voxel = lattice.voxel_size;
  const double voxels = FilledVolume(scene, cells, box) / (voxel * voxel * voxel);
  const Eigen::Vector3d reach =
      (box.max() - lattice.origin).cwiseAbs().cwiseMax((box.min() - lattice.origin).cwiseAbs());
  constexpr double kMaxIndex = 1 << 22;
  const double scale = std::max(std::cbrt(voxels / static_cast<double>(options.max_voxels)),
                                reach.maxCoeff() / voxel / kMaxIndex);
  if (scale > 1) {
    const double world_voxel = voxel * scene.world_from_normalized.scale;
    throw UserError(path.string(),
                    ": with voxels of ",
                    world_voxel,
                    " it would hold about ",
                    voxels,
                    " of them, more than the ",
                    options.max_voxels,
                    " allowed; choose a voxel size of ",
                    world_voxel * scale * 1.01,
                    " or more.");
  }
}

struct GridWriterContext {
  const ExportableScene& scene;
  const VolumeFrame& frame;
  const VolumeExportOptions& options;
};

openvdb::math::Transform::Ptr WorldFromIndex(const ExportableScene& scene,
                                             const VoxelLattice& lattice) {
  const double voxel = lattice.voxel_size * scene.world_from_normalized.scale;
  const Eigen::Vector3d origin = scene.world_from_normalized.Apply(lattice.origin);
  const auto transform = openvdb::math::Transform::createLinearTransform(voxel);
  transform->postTranslate(openvdb::Vec3d(origin.x(), origin.y(), origin.z()));
  if (scene.transform.IsTurned()) {
    // OpenVDB multiplies rows: x_file^T = x^T rotation^T.
    openvdb::Mat4d turn = openvdb::Mat4d::identity();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        turn(column, row) = scene.transform.rotation(row, column);
      }
    }
    transform->postMult(turn);
  }
  return transform;
}

// What every file and every grid says of itself (export/README.md).
openvdb::MetaMap CommonMetadata(const GridWriterContext& context, const ObjectInfo* object) {
  const Similarity& similarity = context.scene.colmap_from_normalized;
  const Eigen::Vector3d& t = similarity.translation;
  openvdb::MetaMap metadata;
  metadata.insertMeta("creator", openvdb::StringMetadata(context.options.creator));
  metadata.insertMeta("labels", openvdb::StringMetadata(LabelTableJson(context.scene.label_table)));
  const ExportTransform& transform = context.scene.transform;
  metadata.insertMeta("frame",
                      openvdb::StringMetadata(transform.IsIdentity() ? "COLMAP" : "transformed"));
  metadata.insertMeta("transform", openvdb::StringMetadata(ExportTransformJson(transform)));
  metadata.insertMeta("voxel_size",
                      openvdb::DoubleMetadata(context.frame.lattice.voxel_size *
                                              context.scene.world_from_normalized.scale));
  metadata.insertMeta("world_from_normalized_scale", openvdb::DoubleMetadata(similarity.scale));
  metadata.insertMeta("world_from_normalized_translation",
                      openvdb::Vec3DMetadata(openvdb::Vec3d(t.x(), t.y(), t.z())));
  if (object != nullptr) {
    metadata.insertMeta("object_id", openvdb::Int32Metadata(object->id));
    metadata.insertMeta("object_name", openvdb::StringMetadata(object->name));
  }
  return metadata;
}

void AddMetadata(const openvdb::MetaMap& metadata, openvdb::MetaMap* target) {
  for (auto it = metadata.beginMeta(); it != metadata.endMeta(); ++it) {
    target->insertMeta(it->first, *it->second);
  }
}

// A grid whose active voxels are those of `blocks`, with value(cell) in each.
template <typename Grid, typename Value>
typename Grid::Ptr MakeGrid(const char* name,
                            const GridWriterContext& context,
                            const std::vector<VoxelBlock>& blocks,
                            const openvdb::MetaMap& metadata,
                            const Value& value) {
  using Leaf = typename Grid::TreeType::LeafNodeType;
  static_assert(Leaf::DIM == 8);
  const typename Grid::Ptr grid = Grid::create();
  std::vector<std::unique_ptr<Leaf>> leaves(blocks.size());
  ParallelForBlocks(static_cast<int64_t>(blocks.size()), kLeavesPerTask, [&](int64_t b, int64_t e) {
    for (int64_t k = b; k < e; ++k) {
      const Eigen::Vector3i& origin = blocks[k].origin;
      leaves[k] = std::make_unique<Leaf>(openvdb::Coord(origin.x(), origin.y(), origin.z()));
      for (openvdb::Index voxel = 0; voxel < Leaf::SIZE; ++voxel) {
        const uint32_t cell = blocks[k].cells[voxel];
        if (cell != kNoCell) leaves[k]->setValueOn(voxel, value(cell));
      }
    }
  });
  for (std::unique_ptr<Leaf>& leaf : leaves) grid->tree().addLeaf(leaf.release());
  // Cells larger than a leaf make leaves of one value, which need no 512 copies of it.
  grid->pruneGrid();
  AddMetadata(metadata, grid.get());
  grid->setName(name);
  grid->setTransform(WorldFromIndex(context.scene, context.frame.lattice));
  return grid;
}

int64_t CountVoxels(const std::vector<VoxelBlock>& blocks) {
  int64_t count = 0;
  for (const VoxelBlock& block : blocks) {
    count += std::count_if(
        block.cells.begin(), block.cells.end(), [](uint32_t cell) { return cell != kNoCell; });
  }
  return count;
}

// An io::File that writes into a stream of ours: OpenVDB's own does not look whether its bytes
// reach the disk, and a volume with its end cut off crashes or stalls its readers.
class StreamArchive : public openvdb::io::Archive {
 public:
  void Write(std::ostream& out,
             const openvdb::GridPtrVec& grids,
             const openvdb::MetaMap& metadata) const {
    openvdb::io::Archive::write(out, grids, /*seekable=*/true, metadata);
  }
};

void WriteGrids(const fs::path& path,
                const openvdb::GridPtrVec& grids,
                const openvdb::MetaMap& metadata) {
  OutputFile output(path);
  {
    std::ofstream out(output.temporary_path(), std::ios::binary);
    StreamArchive archive;
    archive.setCompression(openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    archive.Write(out, grids, metadata);
    out.close();
    if (out.fail()) {
      throw UserError(path.string(), ": cannot be written completely; is the disk full?");
    }
  }
  output.Commit();
}

// The scene's lattice, halved until the object is at least max_resolution / 2 voxels long: every
// voxel of the scene holds 2^3, 4^3, ... of the object's exactly.
VoxelLattice ObjectLattice(const ExportableScene& scene,
                           const ObjectInfo& object,
                           const Eigen::AlignedBox3d& box,
                           const VolumeFrame& frame,
                           const VolumeExportOptions& options) {
  VoxelLattice lattice = frame.lattice;
  if (options.voxel_size > 0) return lattice;
  const double length = RobustBox(scene, object.cells, 0.05, 0, 0).sizes().maxCoeff();
  const double edge = 0.5 * options.max_resolution;
  const double filled = FilledVolume(scene, object.cells, box);
  constexpr int kMaxHalvings = 12;
  for (int halvings = 0; halvings < kMaxHalvings; ++halvings) {
    const double halved = 0.5 * lattice.voxel_size;
    if (!(length > 0) || length >= edge * lattice.voxel_size) break;
    if (filled > std::pow(edge * halved, 3)) break;
    lattice.voxel_size *= 0.5;
    lattice.origin.array() -=
        0.5 * lattice.voxel_size;  // from the centre of eight to that of the first
  }
  return lattice;
}

int64_t WriteVolume(const fs::path& path,
                    const GridWriterContext& context,
                    const std::vector<uint32_t>& cells,
                    const Eigen::AlignedBox3d& box,
                    const ObjectInfo* object) {
  InitializeOpenVdb();
  const ExportableScene& scene = context.scene;
  CheckSize(path, scene, cells, box, context.frame.lattice, context.options);
  const std::vector<VoxelBlock> blocks = VoxelizeCells(scene, cells, context.frame.lattice, box);
  const openvdb::MetaMap metadata = CommonMetadata(context, object);

  const float per_world_unit = static_cast<float>(1 / scene.world_from_normalized.scale);
  const auto density =
      MakeGrid<openvdb::FloatGrid>("density", context, blocks, metadata, [&](uint32_t cell) {
        return scene.density[cell] * per_world_unit;
      });
  density->setGridClass(openvdb::GRID_FOG_VOLUME);
  const auto color =
      MakeGrid<openvdb::Vec3SGrid>("color", context, blocks, metadata, [&](uint32_t cell) {
        const Eigen::Vector3f& display = scene.display_color[cell];
        return openvdb::Vec3s(LinearFromDisplay(display.x()),
                              LinearFromDisplay(display.y()),
                              LinearFromDisplay(display.z()));
      });
  color->setVectorType(openvdb::VEC_INVARIANT);
  const auto label =
      MakeGrid<openvdb::FloatGrid>("label", context, blocks, metadata, [&](uint32_t cell) {
        return static_cast<float>(object != nullptr ? object->id : scene.label_id[cell]);
      });
  const auto confidence =
      MakeGrid<openvdb::FloatGrid>("confidence", context, blocks, metadata, [&](uint32_t cell) {
        return scene.labels.confidence[cell];
      });
  if (context.options.half_float) {
    density->setSaveFloatAsHalf(true);
    color->setSaveFloatAsHalf(true);
    confidence->setSaveFloatAsHalf(true);
  }
  WriteGrids(path, {density, color, label, confidence}, metadata);
  return CountVoxels(blocks);
}

}  // namespace

std::string VolumeExportOptions::Check() const {
  if (!(voxel_size >= 0) || !std::isfinite(voxel_size)) {
    return "voxel_size must be a length in world units, or 0 to follow max_resolution.";
  }
  if (max_resolution < 1 || max_resolution > 65536) return "max_resolution must be 1..65536.";
  if (!(min_optical_depth >= 0)) return "min_optical_depth must not be negative.";
  if (max_voxels < 1) return "max_voxels must be positive.";
  return "";
}

VolumeFrame MakeVolumeFrame(const ExportableScene& scene, const VolumeExportOptions& options) {
  CHECK_EQ(options.Check(), "");
  std::vector<uint32_t> cells;
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    if (scene.labels.solid[i] && scene.photographed[i]) cells.push_back(i);
  }
  if (cells.empty()) {
    // Nothing solid: the box of everything, so that the file is valid and says where the scene is.
    cells.resize(scene.NumSites());
    std::iota(cells.begin(), cells.end(), 0u);
  }
  VolumeFrame frame;
  double edge = 1;
  if (!cells.empty()) {
    frame.box = RobustBox(scene, cells, 0.01, 0.05, MedianRadius(scene, cells));
    edge = frame.box.sizes().maxCoeff();
  }
  if (options.voxel_size > 0) {
    frame.lattice.voxel_size = options.voxel_size / scene.world_from_normalized.scale;
  } else {
    frame.lattice.voxel_size = edge > 0 ? edge / options.max_resolution : 1;
  }
  if (!frame.box.isEmpty()) {
    frame.lattice.origin =
        frame.box.min() + Eigen::Vector3d::Constant(0.5 * frame.lattice.voxel_size);
  }
  return frame;
}

int64_t WriteSceneVolume(const fs::path& path,
                         const ExportableScene& scene,
                         const VolumeFrame& frame,
                         const VolumeExportOptions& options) {
  return WriteVolume(path,
                     {scene, frame, options},
                     CellsOfSceneVolume(scene, options.min_optical_depth),
                     frame.box,
                     nullptr);
}

int64_t WriteObjectVolume(const fs::path& path,
                          const ExportableScene& scene,
                          const ObjectInfo& object,
                          const VolumeFrame& frame,
                          const VolumeExportOptions& options) {
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(0.1 * frame.box.sizes().maxCoeff());
  const Eigen::AlignedBox3d reach(frame.box.min() - margin, frame.box.max() + margin);
  const Eigen::AlignedBox3d box =
      RobustBox(scene, object.cells, 0.05, 1, 4 * MedianRadius(scene, object.cells))
          .intersection(reach);
  const VolumeFrame object_frame{ObjectLattice(scene, object, box, frame, options), box};
  return WriteVolume(path, {scene, object_frame, options}, object.cells, box, &object);
}

int64_t WriteInt32LabelVolume(const fs::path& path,
                              const ExportableScene& scene,
                              const VolumeFrame& frame,
                              const VolumeExportOptions& options) {
  InitializeOpenVdb();
  const GridWriterContext context{scene, frame, options};
  const std::vector<uint32_t> cells = CellsOfSceneVolume(scene, options.min_optical_depth);
  CheckSize(path, scene, cells, frame.box, frame.lattice, options);
  const std::vector<VoxelBlock> blocks = VoxelizeCells(scene, cells, frame.lattice, frame.box);
  const openvdb::MetaMap metadata = CommonMetadata(context, nullptr);
  const auto label = MakeGrid<openvdb::Int32Grid>(
      "label", context, blocks, metadata, [&](uint32_t cell) { return scene.label_id[cell]; });
  WriteGrids(path, {label}, metadata);
  return CountVoxels(blocks);
}

std::vector<WrittenFile> ExportVolumes(const ExportableScene& scene,
                                       const fs::path& output_path,
                                       const VolumeExportOptions& options,
                                       const std::function<void(const WrittenFile&)>& on_written) {
  const VolumeFrame frame = MakeVolumeFrame(scene, options);
  std::vector<WrittenFile> files;
  const auto written = [&](int32_t object_id, const std::string& path, int64_t voxels) {
    files.push_back({object_id, "vdb", path, std::to_string(voxels) + " active voxels"});
    if (on_written) on_written(files.back());
  };
  written(0, "scene.vdb", WriteSceneVolume(output_path / "scene.vdb", scene, frame, options));
  if (options.int32_labels) {
    const std::string name = "scene_labels_int32.vdb";
    written(0, name, WriteInt32LabelVolume(output_path / name, scene, frame, options));
  }
  for (const ObjectInfo& object : scene.objects) {
    const std::string name = "objects/" + object.file_stem + ".vdb";
    written(object.id, name, WriteObjectVolume(output_path / name, scene, object, frame, options));
  }
  return files;
}

}  // namespace semfoam
