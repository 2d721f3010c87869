// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/volume_export.h"

#include "export/io/volume_grids.h"
#include "export/scene/object_selection.h"
#include "export/volume/vdb_grids.h"

#include <memory>

#include <openvdb/openvdb.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// Everything that the files of one export share.
class VolumeMaker {
 public:
  VolumeMaker(const ExportableScene& scene,
              const VolumeFrame& frame,
              const VolumeExportOptions& options)
      : scene_(scene),
        frame_(frame),
        options_(options),
        cells_(scene, options),
        finisher_(scene, options) {}

  const std::vector<const ObjectInfo*>& objects() const { return cells_.objects(); }
  const VolumeFinisher& finisher() const { return finisher_; }

  Volume SceneVolume() const {
    return {nullptr, cells_.CellsOfScene(), frame_.lattice, frame_.box};
  }

  void CheckSize(const fs::path& path, const Volume& volume) const {
    CheckVolumeSize(path, scene_, volume, options_);
  }

  // Calls progress(share), one call at a time, if there is one.
  VolumeGrids Make(const Volume& volume, const std::function<void(double)>& progress) const {
    const VoxelGrids voxels = cells_.Voxels(volume, progress);
    openvdb::FloatGrid::Ptr surface;
    if (volume.object != nullptr) {
      surface = MakeSurfaceLevelSet(
          scene_, *volume.object, volume.lattice, volume.box, finisher_.VoxelSize(volume));
    }
    return finisher_.Finish(volume, voxels, surface);
  }

  int64_t Write(const fs::path& path,
                const Volume& volume,
                const std::function<void(double)>& progress) const {
    CheckSize(path, volume);
    const VolumeGrids made = Make(volume, progress);
    finisher_.WriteFiles(path, made.grids, made.metadata);
    return made.voxels;
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
    const auto transform = finisher_.WorldFromIndex(volume.lattice);
    const auto grid = MakePointGrid(scene_, cells, cells_.values(), volume.lattice, *transform);
    const openvdb::MetaMap metadata = finisher_.Metadata(volume);
    finisher_.Finish("points", "points", volume, metadata, grid.get());
    WriteVdb(path, {grid}, metadata);
    return std::ssize(cells);
  }

 private:
  const ExportableScene& scene_;
  const VolumeFrame& frame_;
  const VolumeExportOptions& options_;
  const VolumeCells cells_;
  const VolumeFinisher finisher_;
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
          maker.finisher().WriteFiles(output_path / path, grids, made.metadata);
          const std::string summary = std::to_string(made.voxels) + " active voxels";
          written({id, "vdb", path, summary, warning});
          if (!options.nvdb) return;
          written({id, "nvdb", fs::path(path).replace_extension(".nvdb").string(), summary, ""});
        };
    write(name, made.grids, maker.finisher().Warning(volume, made.voxels));
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
