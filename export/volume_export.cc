// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/volume_export.h"

#include "export/label_sidecar.h"
#include "export/object_selection.h"
#include "export/vdb_grids.h"
#include "export/volume_fields.h"
#include "foam/error.h"
#include "foam/parallel.h"
#include "foam/srgb.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <set>
#include <sstream>

#include <glog/logging.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Prune.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kBlocksPerTask = 64;

constexpr int kMaxSupersample = 8;

// The box of VolumeExportOptions::crop; nothing where the text is none.
std::optional<Eigen::AlignedBox3d> ParseCrop(const std::string& text) {
  std::array<double, 6> numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (size_t k = 0; k < numbers.size(); ++k) {
    while (at != end && *at == ' ') ++at;
    const auto parsed = std::from_chars(at, end, numbers[k]);
    if (parsed.ec != std::errc() || !std::isfinite(numbers[k])) return std::nullopt;
    at = parsed.ptr;
    const bool is_last = k + 1 == numbers.size();
    if (is_last ? at != end : at == end || *at++ != ',') return std::nullopt;
  }
  const Eigen::AlignedBox3d box(Eigen::Vector3d(numbers[0], numbers[1], numbers[2]),
                                Eigen::Vector3d(numbers[3], numbers[4], numbers[5]));
  if ((box.min().array() >= box.max().array()).any()) return std::nullopt;
  return box;
}

// What is left of a box of the normalised frame.
Eigen::AlignedBox3d Cropped(const Eigen::AlignedBox3d& box,
                            const ExportableScene& scene,
                            const VolumeExportOptions& options) {
  if (options.crop.empty()) return box;
  const Eigen::AlignedBox3d crop = *ParseCrop(options.crop);
  return box.intersection(Eigen::AlignedBox3d(scene.colmap_from_normalized.Invert(crop.min()),
                                              scene.colmap_from_normalized.Invert(crop.max())));
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

// The scene's lattice, halved until the object is at least max_resolution / 2 voxels long: every
// voxel of the scene holds 2^3, 4^3, ... of the object's exactly.
VoxelLattice ObjectLattice(const ExportableScene& scene,
                           const ObjectInfo& object,
                           const Eigen::AlignedBox3d& box,
                           const VolumeFrame& frame,
                           const VolumeExportOptions& options) {
  VoxelLattice lattice = frame.lattice;
  if (options.voxel_size > 0) return lattice;
  // An object of one cell is as long as that.
  const double length = std::max(RobustBox(scene, object.cells, 0.05, 0, 0).sizes().maxCoeff(),
                                 2 * MedianRadius(scene, object.cells));
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

// One volume to be made: its cells (ascending) on its lattice, within its box.
struct Volume {
  const ObjectInfo* object = nullptr;  // null = the scene
  std::vector<uint32_t> cells;
  VoxelLattice lattice;
  Eigen::AlignedBox3d box;
};

Volume ObjectVolume(const ExportableScene& scene,
                    const ObjectInfo& object,
                    const VolumeFrame& frame,
                    const VolumeExportOptions& options) {
  Volume volume;
  volume.object = &object;
  volume.cells = object.cells;
  volume.lattice = frame.lattice;
  if (frame.box.isEmpty()) return volume;
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(0.1 * frame.box.sizes().maxCoeff());
  const Eigen::AlignedBox3d reach(frame.box.min() - margin, frame.box.max() + margin);
  volume.box =
      Cropped(RobustBox(scene, object.cells, 0.05, 1, 4 * MedianRadius(scene, object.cells))
                  .intersection(reach),
              scene,
              options);
  volume.lattice = ObjectLattice(scene, object, volume.box, frame, options);
  return volume;
}

using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using ColorLeaf = openvdb::Vec3STree::LeafNodeType;
using Int32Leaf = openvdb::Int32Tree::LeafNodeType;

// The leaves of one block; none where nobody wants that grid, or the block is empty.
struct BlockLeaves {
  std::unique_ptr<FloatLeaf> density, label, confidence;
  std::unique_ptr<ColorLeaf> color;
  std::unique_ptr<Int32Leaf> label_int32;
};

// What a voxel holds.
struct VoxelValues {
  CellValues values;
  int32_t label = 0;
};

// Makes voxels of samples. For one thread.
template <typename LabelOf>
class VoxelReducer {
 public:
  VoxelReducer(const std::vector<CellValues>& values, LabelOf label_of)
      : values_(values), label_of_(std::move(label_of)) {}

  // The voxel (x, y, z) of the block; false where none of its samples is in a cell.
  bool operator()(const SampleBlock& block, int x, int y, int z, VoxelValues* voxel) {
    const int n = block.samples;
    if (n == 1) {
      const uint32_t cell = block.cells[64 * x + 8 * y + z];
      if (cell == kNoCell) return false;
      *voxel = {values_[cell], label_of_(cell)};
      return true;
    }
    tallies_.clear();
    float density = 0;
    for (int i = n * x; i < n * (x + 1); ++i) {
      for (int j = n * y; j < n * (y + 1); ++j) {
        const uint32_t* column = &block.cells[(static_cast<size_t>(i) * 8 * n + j) * 8 * n];
        for (int k = n * z; k < n * (z + 1); ++k) {
          if (column[k] == kNoCell) continue;
          const CellValues& values = values_[column[k]];
          density += values.density;
          Tally& tally = TallyOf(label_of_(column[k]));
          ++tally.samples;
          tally.color += values.color;
          tally.confidence += values.confidence;
        }
      }
    }
    if (tallies_.empty()) return false;
    const Tally& most =
        *std::min_element(tallies_.begin(), tallies_.end(), [](const Tally& a, const Tally& b) {
          return a.samples != b.samples ? a.samples > b.samples : a.label < b.label;
        });
    const float share = 1 / static_cast<float>(most.samples);
    voxel->values = {
        density / static_cast<float>(n * n * n), most.color * share, most.confidence * share};
    voxel->label = most.label;
    return true;
  }

 private:
  struct Tally {
    int32_t label = 0;
    int samples = 0;
    openvdb::Vec3s color{0.f};
    float confidence = 0;
  };

  Tally& TallyOf(int32_t label) {
    for (Tally& tally : tallies_) {
      if (tally.label == label) return tally;
    }
    tallies_.push_back({label});
    return tallies_.back();
  }

  const std::vector<CellValues>& values_;
  const LabelOf label_of_;
  std::vector<Tally> tallies_;  // a few: of the labels in one voxel
};

template <typename Leaf>
void MakeLeaf(const SampleBlock& block, std::unique_ptr<Leaf>* leaf) {
  static_assert(Leaf::DIM == 8);
  const Eigen::Vector3i& origin = block.origin;
  *leaf = std::make_unique<Leaf>(openvdb::Coord(origin.x(), origin.y(), origin.z()));
}

template <typename Leaf, typename Value>
void SetVoxel(openvdb::Index voxel, const Value& value, Leaf* leaf) {
  if (leaf != nullptr) leaf->setValueOn(voxel, value);
}

// Moves the leaves that `leaf_of` takes out of each block into a grid.
template <typename Grid, typename LeafOf>
typename Grid::Ptr GridOf(std::vector<BlockLeaves>* blocks, const LeafOf& leaf_of) {
  const typename Grid::Ptr grid = Grid::create();
  for (BlockLeaves& block : *blocks) {
    auto& leaf = leaf_of(block);
    if (leaf != nullptr) grid->tree().addLeaf(leaf.release());
  }
  // Cells larger than a leaf make leaves of one value, which need no 512 copies of it.
  openvdb::tools::prune(grid->tree());
  return grid;
}

}  // namespace

struct VolumeGrids {
  openvdb::GridPtrVec grids;
  openvdb::Int32Grid::Ptr label_int32;  // stands in a file of its own; null where nobody wants it
  openvdb::MetaMap metadata;
  int64_t voxels = 0;
};

namespace {

// Everything that the files of one export share.
class VolumeMaker {
 public:
  VolumeMaker(const ExportableScene& scene,
              const VolumeFrame& frame,
              const VolumeExportOptions& options)
      : scene_(scene),
        frame_(frame),
        options_(options),
        objects_(SelectObjects(scene, options.labels)) {
    CHECK_EQ(options.Check(), "");
    InitializeOpenVdb();
    const float per_world_unit = static_cast<float>(1 / scene.world_from_normalized.scale);
    values_.resize(scene.NumSites());
    ParallelForBlocks(scene.NumSites(), 4096, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        const Eigen::Vector3f& display = scene.display_color[i];
        values_[i] = {scene.density[i] * per_world_unit,
                      openvdb::Vec3s(LinearFromDisplay(display.x()),
                                     LinearFromDisplay(display.y()),
                                     LinearFromDisplay(display.z())),
                      scene.labels.confidence[i]};
      }
    });
  }

  const std::vector<const ObjectInfo*>& objects() const { return objects_; }

  Volume SceneVolume() const {
    Volume volume;
    volume.lattice = frame_.lattice;
    volume.box = frame_.box;
    if (options_.labels.empty()) {
      for (uint32_t i = 0; i < scene_.NumSites(); ++i) {
        if (scene_.density[i] * scene_.radius[i] >= options_.min_optical_depth) {
          volume.cells.push_back(i);
        }
      }
    } else {
      volume.cells = CellsOfObjects();
    }
    return volume;
  }

  void CheckSize(const fs::path& path, const Volume& volume) const {
    semfoam::CheckSize(path, scene_, volume.cells, volume.box, volume.lattice, options_);
  }

  // Calls progress(share), one call at a time, if there is one.
  VolumeGrids Make(const Volume& volume, const std::function<void(double)>& progress) const {
    const bool is_scene = volume.object == nullptr;
    const bool wants_label = options_.label_grid_type != "int32";
    const bool wants_int32 = is_scene && options_.label_grid_type != "float";
    const CellVoxelizer voxelizer(
        scene_, volume.cells, volume.lattice, volume.box, options_.supersample);
    const int64_t num_blocks = voxelizer.NumBlocks();
    std::vector<BlockLeaves> blocks(num_blocks);
    std::vector<int64_t> voxels((num_blocks + kBlocksPerTask - 1) / kBlocksPerTask, 0);
    std::mutex mutex;
    int64_t done = 0;
    ParallelForBlocks(num_blocks, kBlocksPerTask, [&](int64_t begin, int64_t end) {
      SampleBlock samples;
      VoxelReducer reduce(values_, [&](uint32_t cell) { return LabelOfCell(cell, volume.object); });
      VoxelValues voxel;
      for (int64_t k = begin; k < end; ++k) {
        if (!voxelizer.Fill(k, &samples)) continue;
        BlockLeaves& leaves = blocks[k];
        MakeLeaf(samples, &leaves.density);
        MakeLeaf(samples, &leaves.color);
        MakeLeaf(samples, &leaves.confidence);
        if (wants_label) MakeLeaf(samples, &leaves.label);
        if (wants_int32) MakeLeaf(samples, &leaves.label_int32);
        for (int x = 0; x < 8; ++x) {
          for (int y = 0; y < 8; ++y) {
            for (int z = 0; z < 8; ++z) {
              if (!reduce(samples, x, y, z, &voxel)) continue;
              const openvdb::Index at = 64 * x + 8 * y + z;
              SetVoxel(at, voxel.values.density, leaves.density.get());
              SetVoxel(at, voxel.values.color, leaves.color.get());
              SetVoxel(at, voxel.values.confidence, leaves.confidence.get());
              SetVoxel(at, static_cast<float>(voxel.label), leaves.label.get());
              SetVoxel(at, voxel.label, leaves.label_int32.get());
              ++voxels[begin / kBlocksPerTask];
            }
          }
        }
      }
      if (progress == nullptr) return;
      const std::lock_guard<std::mutex> lock(mutex);
      done += end - begin;
      progress(static_cast<double>(done) / static_cast<double>(num_blocks));
    });

    VolumeGrids result;
    result.voxels = std::accumulate(voxels.begin(), voxels.end(), int64_t{0});
    result.metadata = Metadata(volume);
    const GridNames& names = options_.grid_names;
    const auto add =
        [&](const char* quantity, const std::string& name, const openvdb::GridBase::Ptr& grid) {
          Finish(quantity, name, volume, result.metadata, grid.get());
          result.grids.push_back(grid);
          return grid;
        };
    openvdb::GridBase::Ptr density, color, label, confidence;
    openvdb::Int32Grid::Ptr label_int32;
    // One grid's leaves are put together by one thread.
    ParallelForBlocks(5, 1, [&](int64_t k, int64_t) {
      switch (k) {
        case 0:
          color = GridOf<openvdb::Vec3SGrid>(
              &blocks, [](auto& b) -> auto& { return b.color; });
          break;
        case 1:
          density = GridOf<openvdb::FloatGrid>(
              &blocks, [](auto& b) -> auto& { return b.density; });
          break;
        case 2:
          confidence = GridOf<openvdb::FloatGrid>(
              &blocks, [](auto& b) -> auto& { return b.confidence; });
          break;
        case 3:
          label = GridOf<openvdb::FloatGrid>(
              &blocks, [](auto& b) -> auto& { return b.label; });
          break;
        default:
          label_int32 = GridOf<openvdb::Int32Grid>(
              &blocks, [](auto& b) -> auto& { return b.label_int32; });
      }
    });
    density->setGridClass(openvdb::GRID_FOG_VOLUME);
    color->setVectorType(openvdb::VEC_INVARIANT);
    for (const auto& grid : {density, color, confidence}) {
      grid->setSaveFloatAsHalf(options_.half_float);
    }
    add("density", names.density, density);
    add("color", names.color, color);
    if (wants_label) add("label", names.label, label);
    add("confidence", names.confidence, confidence);
    if (wants_int32) {
      Finish("label", names.label, volume, result.metadata, label_int32.get());
      result.label_int32 = label_int32;
    }
    if (!is_scene) {
      add("surface",
          names.surface,
          MakeSurfaceLevelSet(
              scene_, *volume.object, volume.lattice, volume.box, VoxelSize(volume)));
    }
    return result;
  }

  int64_t Write(const fs::path& path,
                const Volume& volume,
                const std::function<void(double)>& progress) const {
    CheckSize(path, volume);
    const VolumeGrids made = Make(volume, progress);
    WriteFiles(path, made.grids, made.metadata);
    return made.voxels;
  }

  // The .vdb, and the .nvdb beside it if it is wanted.
  void WriteFiles(const fs::path& path,
                  const openvdb::GridPtrVec& grids,
                  const openvdb::MetaMap& metadata) const {
    WriteVdb(path, grids, metadata);
    if (options_.nvdb) WriteNanoVdb(fs::path(path).replace_extension(".nvdb"), grids);
  }

  // Writes a point for every solid cell, and returns their number.
  int64_t WritePoints(const fs::path& path) const {
    std::vector<uint32_t> cells = CellsOfObjects();
    if (options_.labels.empty()) {
      cells.clear();
      for (uint32_t i = 0; i < scene_.NumSites(); ++i) {
        if (scene_.labels.solid[i] && !scene_.delaunay.Neighbors(i).empty()) cells.push_back(i);
      }
    }
    if (!options_.crop.empty()) {
      const Eigen::AlignedBox3d crop = *ParseCrop(options_.crop);
      std::erase_if(cells, [&](uint32_t cell) {
        return !crop.contains(
            scene_.colmap_from_normalized.Apply(scene_.cell_positions[cell].cast<double>()));
      });
    }
    std::vector<int32_t> labels;
    for (const uint32_t cell : cells) labels.push_back(LabelOfCell(cell, nullptr));
    // A voxel for the points is a leaf of the scene: it takes some points to be worth its memory.
    Volume volume;
    volume.lattice = {frame_.lattice.origin, 8 * frame_.lattice.voxel_size};
    const auto transform = WorldFromIndex(scene_, volume.lattice);
    const auto grid = MakePointGrid(scene_, cells, labels, values_, volume.lattice, *transform);
    const openvdb::MetaMap metadata = Metadata(volume);
    Finish("points", "points", volume, metadata, grid.get());
    WriteVdb(path, {grid}, metadata);
    return std::ssize(cells);
  }

  // One sentence for a volume of hardly any voxel; else nothing.
  std::string Warning(const Volume& volume, int64_t voxels) const {
    const double voxel = VoxelSize(volume);
    if (volume.box.isEmpty() && !options_.crop.empty()) return "nothing of it lies in the crop";
    if (volume.object == nullptr) {
      return voxels > 0 ? "" : "it has no voxel: nothing in its box is dense enough";
    }
    const double length = volume.object->bounding_box.sizes().maxCoeff();
    if (voxels > 1 && voxel <= length) return "";
    std::ostringstream text;
    text << (voxels == 0   ? "it has no voxel"
             : voxels == 1 ? "it has one voxel"
                           : "its voxels are larger than the object")
         << " (voxels of " << voxel << ", an object of " << length << "); a voxel_size of "
         << length / 32 << " or less would show its shape";
    return text.str();
  }

 private:
  // Edge of a voxel in the frame of the file.
  double VoxelSize(const Volume& volume) const {
    return WorldFromIndex(scene_, volume.lattice)->voxelSize().x();
  }

  std::vector<uint32_t> CellsOfObjects() const {
    std::vector<uint32_t> cells;
    for (const ObjectInfo* object : objects_) {
      cells.insert(cells.end(), object->cells.begin(), object->cells.end());
    }
    std::sort(cells.begin(), cells.end());
    return cells;
  }

  int32_t LabelOfCell(uint32_t cell, const ObjectInfo* object) const {
    if (object != nullptr) return object->id;
    if (options_.labels.empty()) return scene_.label_id[cell];
    return scene_.objects[scene_.object_of_cell[cell]].id;
  }

  // What every file and every grid says of itself (export/README.md).
  openvdb::MetaMap Metadata(const Volume& volume) const {
    const Similarity& similarity = scene_.colmap_from_normalized;
    const Eigen::Vector3d& t = similarity.translation;
    openvdb::MetaMap metadata;
    const auto add_text = [&](const char* key, const std::string& text) {
      metadata.insertMeta(key, openvdb::StringMetadata(text));
    };
    add_text("creator", options_.creator);
    add_text("labels", LabelTableJson(scene_.label_table));
    add_text("frame", scene_.transform.IsIdentity() ? "COLMAP" : "transformed");
    add_text("transform", ExportTransformJson(scene_.transform));
    if (!options_.source_checksum.empty()) {
      add_text("source_model_xxh64", options_.source_checksum);
    }
    metadata.insertMeta("voxel_size", openvdb::DoubleMetadata(VoxelSize(volume)));
    metadata.insertMeta("world_from_normalized_scale", openvdb::DoubleMetadata(similarity.scale));
    metadata.insertMeta("world_from_normalized_translation",
                        openvdb::Vec3DMetadata(openvdb::Vec3d(t.x(), t.y(), t.z())));
    if (volume.object != nullptr) {
      metadata.insertMeta("object_id", openvdb::Int32Metadata(volume.object->id));
      add_text("object_name", volume.object->name);
    }
    return metadata;
  }

  void Finish(const std::string& quantity,
              const std::string& name,
              const Volume& volume,
              const openvdb::MetaMap& metadata,
              openvdb::GridBase* grid) const {
    for (auto it = metadata.beginMeta(); it != metadata.endMeta(); ++it) {
      grid->insertMeta(it->first, *it->second);
    }
    grid->insertMeta(kQuantityKey, openvdb::StringMetadata(quantity));
    grid->setName(name);
    grid->setTransform(WorldFromIndex(scene_, volume.lattice));
  }

  const ExportableScene& scene_;
  const VolumeFrame& frame_;
  const VolumeExportOptions& options_;
  const std::vector<const ObjectInfo*> objects_;
  std::vector<CellValues> values_;  // by cell
};

}  // namespace

std::string VolumeExportOptions::Check() const {
  if (!(voxel_size >= 0) || !std::isfinite(voxel_size)) {
    return "voxel_size must be a length in world units, or 0 to follow max_resolution.";
  }
  if (max_resolution < 1 || max_resolution > 65536) return "max_resolution must be 1..65536.";
  if (!crop.empty() && !ParseCrop(crop)) {
    return "crop must be six numbers x0,y0,z0,x1,y1,z1 with x0 < x1, y0 < y1 and z0 < z1; it is '" +
           crop + "'.";
  }
  if (supersample < 1 || supersample > kMaxSupersample) {
    return "supersample must be 1.." + std::to_string(kMaxSupersample) + ".";
  }
  if (label_grid_type != "float" && label_grid_type != "int32" && label_grid_type != "both") {
    return "label_grid_type must be float, int32 or both.";
  }
  std::set<std::string> names;
  for (const std::string* name : {&grid_names.density,
                                  &grid_names.color,
                                  &grid_names.label,
                                  &grid_names.confidence,
                                  &grid_names.surface}) {
    const bool is_plain = std::all_of(name->begin(), name->end(), [](char c) {
      return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    });
    if (name->empty() || !is_plain) {
      return "a grid's name must be letters, digits and '_'; '" + *name + "' is not.";
    }
    if (!names.insert(*name).second) {
      return "grids must have different names; two are called '" + *name + "'.";
    }
  }
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
  Eigen::Vector3d corner = Eigen::Vector3d::Zero();
  double edge = 1;
  if (!cells.empty()) {
    const Eigen::AlignedBox3d whole =
        RobustBox(scene, cells, 0.01, 0.05, MedianRadius(scene, cells));
    corner = whole.min();
    frame.box = Cropped(whole, scene, options);
    edge = (frame.box.isEmpty() ? whole : frame.box).sizes().maxCoeff();
  }
  if (options.voxel_size > 0) {
    frame.lattice.voxel_size = options.voxel_size / scene.world_from_normalized.scale;
  } else {
    frame.lattice.voxel_size = edge > 0 ? edge / options.max_resolution : 1;
  }
  frame.lattice.origin = corner + Eigen::Vector3d::Constant(0.5 * frame.lattice.voxel_size);
  return frame;
}

std::shared_ptr<const VolumeGrids> MakeSceneGrids(const ExportableScene& scene,
                                                  const VolumeFrame& frame,
                                                  const VolumeExportOptions& options) {
  const VolumeMaker maker(scene, frame, options);
  return std::make_shared<VolumeGrids>(maker.Make(maker.SceneVolume(), nullptr));
}

int64_t NumVoxels(const VolumeGrids& grids) { return grids.voxels; }

int64_t WriteSceneVolume(const fs::path& path,
                         const ExportableScene& scene,
                         const VolumeFrame& frame,
                         const VolumeExportOptions& options) {
  const VolumeMaker maker(scene, frame, options);
  return maker.Write(path, maker.SceneVolume(), nullptr);
}

int64_t WriteObjectVolume(const fs::path& path,
                          const ExportableScene& scene,
                          const ObjectInfo& object,
                          const VolumeFrame& frame,
                          const VolumeExportOptions& options) {
  const VolumeMaker maker(scene, frame, options);
  return maker.Write(path, ObjectVolume(scene, object, frame, options), nullptr);
}

std::vector<WrittenFile> ExportVolumes(
    const ExportableScene& scene,
    const fs::path& output_path,
    const VolumeExportOptions& options,
    const std::function<void(const WrittenFile&)>& on_written,
    const std::function<void(const VolumeProgress&)>& on_progress) {
  const VolumeFrame frame = MakeVolumeFrame(scene, options);
  const VolumeMaker maker(scene, frame, options);
  struct Planned {
    std::string name;
    Volume volume;
  };
  std::vector<Planned> plan = {{"scene.vdb", maker.SceneVolume()}};
  for (const ObjectInfo* object : maker.objects()) {
    plan.push_back(
        {"objects/" + object->file_stem + ".vdb", ObjectVolume(scene, *object, frame, options)});
  }
  // What is too large is said before anything is written.
  for (const Planned& file : plan) maker.CheckSize(output_path / file.name, file.volume);

  std::vector<WrittenFile> files;
  const auto written = [&](WrittenFile file) {
    files.push_back(std::move(file));
    if (on_written) on_written(files.back());
  };
  VolumeProgress progress;
  progress.num_files = static_cast<int>(plan.size());
  for (const auto& [name, volume] : plan) {
    progress.path = name;
    ++progress.file;
    std::function<void(double)> report;
    if (on_progress) {
      report = [&](double share) {
        progress.share = share;
        on_progress(progress);
      };
    }
    const VolumeGrids made = maker.Make(volume, report);
    const int32_t id = volume.object == nullptr ? 0 : volume.object->id;
    const auto write =
        [&](const std::string& path, const openvdb::GridPtrVec& grids, const std::string& warning) {
          maker.WriteFiles(output_path / path, grids, made.metadata);
          const std::string summary = std::to_string(made.voxels) + " active voxels";
          written({id, "vdb", path, summary, warning});
          if (!options.nvdb) return;
          written({id, "nvdb", fs::path(path).replace_extension(".nvdb").string(), summary, ""});
        };
    write(name, made.grids, maker.Warning(volume, made.voxels));
    if (made.label_int32 != nullptr) write("scene_labels_int32.vdb", {made.label_int32}, "");
    if (volume.object == nullptr && options.points) {
      const std::string points = "scene_points.vdb";
      const int64_t count = maker.WritePoints(output_path / points);
      written({0, "vdb", points, std::to_string(count) + " points"});
    }
  }
  return files;
}

}  // namespace semfoam
