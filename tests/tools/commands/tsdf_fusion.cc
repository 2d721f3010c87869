// SPDX-License-Identifier: GPL-3.0-or-later
//
// tsdf_fusion SCENE.foam OUT [VOXELS]: fuses the depth that a foam has in its training photos into
// a truncated signed distance for each object (Curless and Levoy 1996), and writes its zero level
// as OUT/<id>_<name>.obj: the baseline of the surfaces that are exported, for measurements by hand.
//
// An object's diagonal has VOXELS voxels (200), the distance is truncated at three of them. A pixel
// of the object tells how far a voxel is from its surface; a pixel of anything else, that voxels
// before it are empty. Voxels that no photo tells of make no surface, so the meshes have holes
// there.
#include "export/scene/exportable_scene.h"
#include "export/surface/surface_box.h"
#include "foam/model/model.h"
#include "foam/util/parallel.h"
#include "foam/view/view_renderer.h"
#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/camera_rays.h"
#include "tools/images/view_images.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <vector>

#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>

namespace semfoam {
namespace {

constexpr double kTruncation = 3;  // voxels

// What a training photo shows, by the foam.
struct DepthView {
  Camera camera;
  Eigen::Matrix3d world_to_camera;
  Eigen::Vector3d translation;
  std::vector<float> depth;  // [height][width], along z; 0: none
  LabelImage ids;
};

std::vector<DepthView> RenderTrainingViews(const Model& model) {
  const ViewRenderer renderer(model.foam);
  std::vector<DepthView> views;
  for (const PhotoRecord& photo : model.photos) {
    if (photo.held_out) continue;
    DepthView view;
    view.camera = CameraOf(photo, "model");
    const Pose cam_from_world = {photo.cam_from_world_rotation, photo.cam_from_world_translation};
    view.world_to_camera = cam_from_world.UnitRotation().toRotationMatrix();
    view.translation = cam_from_world.translation;
    const CameraRays rays =
        MakeCameraRays(view.camera, cam_from_world, model.world_from_normalized);
    const RenderedView render = renderer.Render(rays);
    const Eigen::Vector3d z_axis = view.world_to_camera.transpose() * Eigen::Vector3d::UnitZ();
    view.depth = DepthImage(render, rays, z_axis, model.world_from_normalized.scale);
    view.ids = LabelIdImage(render, model.labels);
    views.push_back(std::move(view));
  }
  return views;
}

// The sites of what photos show of an object, where it is not cut off; in the COLMAP frame.
Eigen::AlignedBox3d BoxOf(const ExportableScene& scene, const ObjectInfo& object) {
  Eigen::AlignedBox3d box;
  for (const uint32_t cell : CellsInBox(scene, object.cells, SurfaceBox(scene, object.cells))) {
    if (!scene.photographed[cell]) continue;
    box.extend(scene.colmap_from_normalized.Apply(scene.cell_positions[cell].cast<double>()));
  }
  return box;
}

// Returns how far a place is from the surface, in voxels, in the mean of what photos tell; nothing
// where none does.
std::optional<float> DistanceAt(const std::vector<DepthView>& views,
                                LabelId object,
                                const Eigen::Vector3d& place,
                                double voxel_size) {
  double sum = 0;
  int count = 0;
  for (const DepthView& view : views) {
    const Eigen::Vector3d in_camera = view.world_to_camera * place + view.translation;
    if (in_camera.z() <= 0) continue;
    const auto pixel = Project(view.camera, in_camera);
    if (!pixel || !(pixel->x() >= 0 && pixel->x() < view.ids.width && pixel->y() >= 0 &&
                    pixel->y() < view.ids.height)) {
      continue;
    }
    const size_t at =
        static_cast<size_t>(pixel->y()) * view.ids.width + static_cast<size_t>(pixel->x());
    if (view.depth[at] == 0) continue;
    const double distance = (view.depth[at] - in_camera.z()) / voxel_size;
    const bool is_object = view.ids.data[at] == Value(object);
    if (distance < (is_object ? -kTruncation : kTruncation)) continue;
    sum += std::min(distance, kTruncation);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return static_cast<float>(sum / count);
}

// Returns those distances in the voxels of a box; active where a photo tells one.
openvdb::FloatGrid::Ptr Fuse(const std::vector<DepthView>& views,
                             LabelId object,
                             const Eigen::AlignedBox3d& box,
                             double voxel_size) {
  const Eigen::Vector3i size = (box.sizes() / voxel_size).array().ceil().cast<int>();
  const auto index = [&](int x, int y, int z) {
    return (static_cast<size_t>(z) * size.y() + y) * size.x() + x;
  };
  std::vector<std::optional<float>> distances(index(0, 0, size.z()));
  ParallelForBlocks(size.z(), 1, [&](int64_t z, int64_t) {
    for (int y = 0; y < size.y(); ++y) {
      for (int x = 0; x < size.x(); ++x) {
        const Eigen::Vector3d place =
            box.min() + voxel_size * Eigen::Vector3d(x, y, static_cast<double>(z));
        distances[index(x, y, static_cast<int>(z))] = DistanceAt(views, object, place, voxel_size);
      }
    }
  });
  const openvdb::FloatGrid::Ptr grid = openvdb::FloatGrid::create(static_cast<float>(kTruncation));
  openvdb::FloatGrid::Accessor accessor = grid->getAccessor();
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      for (int x = 0; x < size.x(); ++x) {
        if (const auto& distance = distances[index(x, y, z)]) {
          accessor.setValue(openvdb::Coord(x, y, z), *distance);
        }
      }
    }
  }
  return grid;
}

// Writes the zero level between voxels that photos tell of; returns its number of faces.
size_t WriteZeroLevel(const openvdb::FloatGrid& grid,
                      const Eigen::AlignedBox3d& box,
                      double voxel_size,
                      const std::filesystem::path& path) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(grid, points, quads);
  const openvdb::FloatGrid::ConstAccessor accessor = grid.getConstAccessor();
  std::vector<bool> is_known(points.size());
  std::ofstream out(path);
  for (size_t i = 0; i < points.size(); ++i) {
    const openvdb::Coord first = openvdb::Coord::floor(points[i]);
    bool known = true;
    for (int corner = 0; corner < 8; ++corner) {
      known &= accessor.isValueOn(first.offsetBy(corner & 1, (corner >> 1) & 1, (corner >> 2) & 1));
    }
    is_known[i] = known;
    const Eigen::Vector3d place =
        box.min() + voxel_size * Eigen::Vector3d(points[i].x(), points[i].y(), points[i].z());
    out << "v " << place.x() << ' ' << place.y() << ' ' << place.z() << '\n';
  }
  size_t faces = 0;
  for (const openvdb::Vec4I& quad : quads) {
    if (!is_known[quad[0]] || !is_known[quad[1]] || !is_known[quad[2]] || !is_known[quad[3]]) {
      continue;
    }
    ++faces;
    // OpenVDB's are clockwise from outside.
    out << "f " << quad[3] + 1 << ' ' << quad[2] + 1 << ' ' << quad[1] + 1 << ' ' << quad[0] + 1
        << '\n';
  }
  return faces;
}

}  // namespace
}  // namespace semfoam

int main(int argc, char** argv) {
  using namespace semfoam;
  const int voxels = argc > 3 ? std::atoi(argv[3]) : 200;
  if (argc < 3 || voxels < 10 || voxels > 1000) {
    std::fprintf(stderr, "Usage: tsdf_fusion SCENE.foam OUT [VOXELS, 10 to 1000]\n");
    return 1;
  }
  openvdb::initialize();
  const Model model = ReadModel(argv[1]);
  const ExportableScene scene = MakeExportableScene(model);
  const std::vector<DepthView> views = RenderTrainingViews(model);
  std::filesystem::create_directories(argv[2]);
  for (const ObjectInfo& object : scene.objects) {
    Eigen::AlignedBox3d box = BoxOf(scene, object);
    if (box.isEmpty()) continue;
    const double voxel_size = box.diagonal().norm() / voxels;
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(5 * voxel_size);
    box = Eigen::AlignedBox3d(box.min() - margin, box.max() + margin);
    const openvdb::FloatGrid::Ptr grid = Fuse(views, object.id, box, voxel_size);
    const size_t faces = WriteZeroLevel(
        *grid, box, voxel_size, std::filesystem::path(argv[2]) / (object.file_stem + ".obj"));
    std::printf("%s: %zu faces\n", object.file_stem.c_str(), faces);
    std::fflush(stdout);
  }
  return 0;
}
