// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/volume_grids.h"

#include "export/io/label_sidecar.h"
#include "export/io/volume_fields.h"
#include "export/scene/object_selection.h"
#include "foam/image/srgb.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <sstream>

#include <glog/logging.h>

namespace semfoam {

namespace fs = std::filesystem;

LabelGrids WantedLabels(bool is_scene, const VolumeExportOptions& options) {
  LabelGrids wanted;
  wanted.label = options.label_grid_type != LabelGridType::kInt32;
  wanted.label_int32 = is_scene && options.label_grid_type != LabelGridType::kFloat;
  return wanted;
}

VolumeCells::VolumeCells(const ExportableScene& scene, const VolumeExportOptions& options)
    : scene_(scene), options_(options), objects_(SelectObjects(scene, options.objects)) {
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

std::vector<uint32_t> VolumeCells::CellsOfScene() const {
  std::vector<uint32_t> cells;
  if (options_.objects.only) {
    for (const ObjectInfo* object : objects_) {
      cells.insert(cells.end(), object->cells.begin(), object->cells.end());
    }
    std::sort(cells.begin(), cells.end());
    return cells;
  }
  for (uint32_t i = 0; i < scene_.NumSites(); ++i) {
    if (scene_.density[i] * scene_.radius[i] >= options_.min_optical_depth &&
        HasCell(scene_, options_.objects, i)) {
      cells.push_back(i);
    }
  }
  return cells;
}

VoxelGrids VolumeCells::Voxels(const Volume& volume,
                               const std::function<void(double)>& progress) const {
  const bool is_scene = volume.object == nullptr;
  const CellVoxelizer voxelizer(
      scene_, volume.cells, volume.lattice, volume.box, options_.supersample);
  VoxelLabels labels;
  if (is_scene) {
    labels.by_cell = labels_;
  } else {
    labels.of_all = volume.object->id;
  }
  return MakeVoxelGrids(voxelizer, values_, labels, WantedLabels(is_scene, options_), progress);
}

openvdb::math::Transform::Ptr VolumeFinisher::WorldFromIndex(const VoxelLattice& lattice) const {
  const double voxel = lattice.voxel_size * scene_.world_from_normalized.scale;
  const Eigen::Vector3d origin = scene_.world_from_normalized.Apply(lattice.origin);
  auto transform = openvdb::math::Transform::createLinearTransform(voxel);
  transform->postTranslate(openvdb::Vec3d(origin.x(), origin.y(), origin.z()));
  if (scene_.transform.IsTurned()) {
    // OpenVDB multiplies rows: x_file^T = x^T rotation^T.
    openvdb::Mat4d turn = openvdb::Mat4d::identity();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        turn(column, row) = scene_.transform.rotation(row, column);
      }
    }
    transform->postMult(turn);
  }
  return transform;
}

double VolumeFinisher::VoxelSize(const Volume& volume) const {
  return WorldFromIndex(volume.lattice)->voxelSize().x();
}

openvdb::MetaMap VolumeFinisher::Metadata(const Volume& volume) const {
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

void VolumeFinisher::Finish(const std::string& quantity,
                            const std::string& name,
                            const Volume& volume,
                            const openvdb::MetaMap& metadata,
                            openvdb::GridBase* grid) const {
  for (auto it = metadata.beginMeta(); it != metadata.endMeta(); ++it) {
    grid->insertMeta(it->first, *it->second);
  }
  grid->insertMeta(kQuantityKey, openvdb::StringMetadata(quantity));
  grid->setName(name);
  grid->setTransform(WorldFromIndex(volume.lattice));
}

VolumeGrids VolumeFinisher::Finish(const Volume& volume,
                                   const VoxelGrids& voxels,
                                   const openvdb::FloatGrid::Ptr& surface) const {
  voxels.density->setGridClass(openvdb::GRID_FOG_VOLUME);
  voxels.color->setVectorType(openvdb::VEC_INVARIANT);
  voxels.density->setSaveFloatAsHalf(options_.half_float);
  voxels.color->setSaveFloatAsHalf(options_.half_float);
  voxels.confidence->setSaveFloatAsHalf(options_.half_float);

  const LabelGrids wanted = WantedLabels(volume.object == nullptr, options_);
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
  if (surface != nullptr) add("surface", names.surface, surface);
  return result;
}

void VolumeFinisher::WriteFiles(const fs::path& path,
                                const openvdb::GridPtrVec& grids,
                                const openvdb::MetaMap& metadata) const {
  WriteVdb(path, grids, metadata);
  if (options_.nvdb) WriteNanoVdb(fs::path(path).replace_extension(".nvdb"), grids);
}

std::string VolumeFinisher::Warning(const Volume& volume, int64_t voxels) const {
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

}  // namespace semfoam
