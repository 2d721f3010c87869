// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/volume_export.h"

#include "export/io/label_sidecar.h"
#include "export/io/volume_fields.h"
#include "export/scene/object_selection.h"
#include "export/volume/vdb_grids.h"
#include "foam/image/srgb.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <memory>
#include <sstream>

#include <glog/logging.h>
#include <openvdb/openvdb.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

openvdb::math::Transform::Ptr WorldFromIndex(const ExportableScene& scene,
                                             const VoxelLattice& lattice) {
  const double voxel = lattice.voxel_size * scene.world_from_normalized.scale;
  const Eigen::Vector3d origin = scene.world_from_normalized.Apply(lattice.origin);
  auto transform = openvdb::math::Transform::createLinearTransform(voxel);
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

}  // namespace

struct VolumeGrids {
  openvdb::GridPtrVec grids;
  // Written to a separate file; null if not requested.
  openvdb::Int32Grid::Ptr label_int32;
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
        objects_(SelectObjects(scene, options.objects)) {
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
    labels_ = scene.label_id;
    if (!options.objects.only) return;
    for (const ObjectInfo* object : objects_) {
      for (const uint32_t cell : object->cells) labels_[cell] = object->id;
    }
  }

  const std::vector<const ObjectInfo*>& objects() const { return objects_; }

  Volume SceneVolume() const {
    Volume volume;
    volume.lattice = frame_.lattice;
    volume.box = frame_.box;
    if (!options_.objects.only) {
      for (uint32_t i = 0; i < scene_.NumSites(); ++i) {
        if (scene_.density[i] * scene_.radius[i] >= options_.min_optical_depth &&
            HasCell(scene_, options_.objects, i)) {
          volume.cells.push_back(i);
        }
      }
    } else {
      volume.cells = CellsOfObjects();
    }
    return volume;
  }

  void CheckSize(const fs::path& path, const Volume& volume) const {
    CheckVolumeSize(path, scene_, volume, options_);
  }

  // Calls progress(share), one call at a time, if there is one.
  VolumeGrids Make(const Volume& volume, const std::function<void(double)>& progress) const {
    const bool is_scene = volume.object == nullptr;
    LabelGrids wanted;
    wanted.label = options_.label_grid_type != LabelGridType::kInt32;
    wanted.label_int32 = is_scene && options_.label_grid_type != LabelGridType::kFloat;
    const CellVoxelizer voxelizer(
        scene_, volume.cells, volume.lattice, volume.box, options_.supersample);
    VoxelLabels labels;
    if (is_scene) {
      labels.by_cell = labels_;
    } else {
      labels.of_all = volume.object->id;
    }
    const VoxelGrids voxels = MakeVoxelGrids(voxelizer, values_, labels, wanted, progress);
    voxels.density->setGridClass(openvdb::GRID_FOG_VOLUME);
    voxels.color->setVectorType(openvdb::VEC_INVARIANT);
    voxels.density->setSaveFloatAsHalf(options_.half_float);
    voxels.color->setSaveFloatAsHalf(options_.half_float);
    voxels.confidence->setSaveFloatAsHalf(options_.half_float);

    VolumeGrids result;
    result.voxels = voxels.num_voxels;
    result.metadata = Metadata(volume);
    const GridNames& names = options_.grid_names;
    const auto add =
        [&](const char* quantity, const std::string& name, const openvdb::GridBase::Ptr& grid) {
          Finish(quantity, name, volume, result.metadata, grid.get());
          result.grids.push_back(grid);
        };
    add("density", names.density, voxels.density);
    add("color", names.color, voxels.color);
    if (wanted.label) add("label", names.label, voxels.label);
    add("confidence", names.confidence, voxels.confidence);
    if (wanted.label_int32) {
      Finish("label", names.label, volume, result.metadata, voxels.label_int32.get());
      result.label_int32 = voxels.label_int32;
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

  // Writes a point for every solid cell that the options have, and returns their number.
  int64_t WritePoints(const fs::path& path) const {
    std::vector<uint32_t> cells;
    for (uint32_t i = 0; i < scene_.NumSites(); ++i) {
      if (scene_.labels.solid[i] && !scene_.delaunay.Neighbors(i).empty() &&
          HasCell(scene_, options_.objects, i)) {
        cells.push_back(i);
      }
    }
    if (const auto crop = ParseCrop(options_.crop)) {
      std::erase_if(cells, [&](uint32_t cell) {
        return !crop->contains(
            scene_.colmap_from_normalized.Apply(scene_.cell_positions[cell].cast<double>()));
      });
    }
    // A voxel for the points is a leaf of the scene: it takes some points to be worth its memory.
    Volume volume;
    volume.lattice = {frame_.lattice.origin, 8 * frame_.lattice.voxel_size};
    const auto transform = WorldFromIndex(scene_, volume.lattice);
    const auto grid = MakePointGrid(scene_, cells, values_, volume.lattice, *transform);
    const openvdb::MetaMap metadata = Metadata(volume);
    Finish("points", "points", volume, metadata, grid.get());
    WriteVdb(path, {grid}, metadata);
    return std::ssize(cells);
  }

  // Returns one sentence for a volume of hardly any voxel; else nothing.
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
      add_text(kSourceModelKey, options_.source_checksum);
    }
    metadata.insertMeta("voxel_size", openvdb::DoubleMetadata(VoxelSize(volume)));
    metadata.insertMeta("world_from_normalized_scale", openvdb::DoubleMetadata(similarity.scale));
    metadata.insertMeta("world_from_normalized_translation",
                        openvdb::Vec3DMetadata(openvdb::Vec3d(t.x(), t.y(), t.z())));
    if (volume.object != nullptr) {
      metadata.insertMeta("object_id", openvdb::Int32Metadata(Value(volume.object->id)));
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
  std::vector<LabelId> labels_;     // by cell: in the files of the scene
};

}  // namespace

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
    const LabelId id = volume.object == nullptr ? kNoObject : volume.object->id;
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
      written({kNoObject, "vdb", points, std::to_string(count) + " points"});
    }
  }
  return files;
}

}  // namespace semfoam
