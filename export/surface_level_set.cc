// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface_export.h"
#include "export/vdb_grids.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <openvdb/tools/Composite.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/Prune.h>
#include <tbb/task_arena.h>

namespace semfoam {
namespace {

constexpr float kHalfWidth = 3;  // voxels
// Where the object is cut, its level set is made so many voxels farther than the cut: a leaf of the
// box's level set reaches half width + 7 voxels out of the box, and the half-finished blocks at the
// end of the work are 8 wide.
constexpr double kMargin = 20;

// Triangles in index space, as meshToVolume asks for them.
class TriangleSoup {
 public:
  void Add(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
    triangles_.push_back({a, b, c});
  }

  size_t polygonCount() const { return triangles_.size(); }
  size_t pointCount() const { return 3 * triangles_.size(); }
  size_t vertexCount(size_t /*polygon*/) const { return 3; }
  void getIndexSpacePoint(size_t polygon, size_t corner, openvdb::Vec3d& point) const {
    const Eigen::Vector3d& p = triangles_[polygon][corner];
    point = openvdb::Vec3d(p.x(), p.y(), p.z());
  }

 private:
  std::vector<std::array<Eigen::Vector3d, 3>> triangles_;
};

// What is left of a convex polygon inside of the box; Sutherland and Hodgman, one side after the
// other.
void ClipToBox(const Eigen::AlignedBox3d& box, std::vector<Eigen::Vector3d>* polygon) {
  std::vector<Eigen::Vector3d> kept;
  for (int side = 0; side < 6; ++side) {
    const int axis = side / 2;
    const double sign = side % 2 == 0 ? 1 : -1;
    const double limit = sign * (side % 2 == 0 ? box.max() : box.min())[axis];
    kept.clear();
    for (size_t k = 0; k < polygon->size(); ++k) {
      const Eigen::Vector3d& from = (*polygon)[k];
      const Eigen::Vector3d& to = (*polygon)[(k + 1) % polygon->size()];
      const double room_from = limit - sign * from[axis];
      const double room_to = limit - sign * to[axis];
      if (room_from >= 0) kept.push_back(from);
      if ((room_from >= 0) != (room_to >= 0)) {
        kept.push_back(from + room_from / (room_from - room_to) * (to - from));
      }
    }
    polygon->swap(kept);
  }
}

// The triangles of the object's surface as far as they lie in `region`, index space.
TriangleSoup SurfaceIn(const ExportableScene& scene,
                       const ObjectSurface& surface,
                       const VoxelLattice& lattice,
                       const Eigen::AlignedBox3d& region) {
  TriangleSoup soup;
  std::vector<Eigen::Vector3d> polygon;
  for (const std::array<uint32_t, 3>& triangle : surface.triangles) {
    polygon.clear();
    Eigen::AlignedBox3d around;
    for (const uint32_t vertex : triangle) {
      const Eigen::Vector3d& corner = scene.voronoi_vertices[surface.vertex_tet[vertex]];
      polygon.push_back((corner - lattice.origin) / lattice.voxel_size);
      around.extend(polygon.back());
    }
    if (!region.contains(around)) ClipToBox(region, &polygon);
    for (size_t k = 2; k < polygon.size(); ++k) soup.Add(polygon[0], polygon[k - 1], polygon[k]);
  }
  return soup;
}

Eigen::AlignedBox3d Widened(const Eigen::AlignedBox3d& box, double margin) {
  const Eigen::Vector3d all_around = Eigen::Vector3d::Constant(margin);
  return {box.min() - all_around, box.max() + all_around};
}

// Makes the voxels of `blocks` the inside: their distances, which are unsigned so far, get a minus,
// and where no surface is near, the block is one tile.
void SetSigns(const std::vector<VoxelBlock>& blocks, openvdb::FloatTree* tree) {
  const float inside = -tree->background();
  for (const VoxelBlock& block : blocks) {
    const openvdb::Coord origin(block.origin.x(), block.origin.y(), block.origin.z());
    if (openvdb::FloatTree::LeafNodeType* leaf = tree->probeLeaf(origin)) {
      float* values = leaf->buffer().data();
      for (size_t voxel = 0; voxel < block.cells.size(); ++voxel) {
        if (block.cells[voxel] != kNoCell) values[voxel] = -values[voxel];
      }
    } else if (std::count(block.cells.begin(), block.cells.end(), kNoCell) == 0) {
      tree->addTile(/*level=*/1, origin, inside, /*active=*/false);
    }
  }
}

}  // namespace

openvdb::FloatGrid::Ptr MakeSurfaceLevelSet(const ExportableScene& scene,
                                            const ObjectInfo& object,
                                            const VoxelLattice& lattice,
                                            const Eigen::AlignedBox3d& box) {
  InitializeOpenVdb();
  const double world_voxel = lattice.voxel_size * scene.world_from_normalized.scale;
  const auto transform = openvdb::math::Transform::createLinearTransform(world_voxel);
  if (box.isEmpty()) {
    return openvdb::createLevelSet<openvdb::FloatGrid>(world_voxel, kHalfWidth);
  }
  const ObjectSurface surface = ExtractSurface(scene, object);
  const bool is_cut =
      std::any_of(surface.vertex_tet.begin(), surface.vertex_tet.end(), [&](uint32_t tet) {
        return !box.contains(scene.voronoi_vertices[tet]);
      });
  const Eigen::AlignedBox3d region =
      Widened(box, (is_cut ? kMargin : kHalfWidth + 1) * lattice.voxel_size);
  const Eigen::AlignedBox3d index_region((region.min() - lattice.origin) / lattice.voxel_size,
                                         (region.max() - lattice.origin) / lattice.voxel_size);
  const TriangleSoup soup = SurfaceIn(scene, surface, lattice, index_region);

  const std::vector<VoxelBlock> blocks = VoxelizeCells(scene, object.cells, lattice, region);
  openvdb::FloatGrid::Ptr grid;
  // Which of two triangles at the same distance a voxel remembers depends on the threads, and with
  // it the last bits of the distances that it hands on.
  tbb::task_arena one_thread(1);
  one_thread.execute([&] {
    // Unsigned: spikes and sheets thinner than a voxel are no trouble, and a surface that is cut
    // open at the region's end needs no inside.
    grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
        soup, *transform, kHalfWidth, kHalfWidth, openvdb::tools::UNSIGNED_DISTANCE_FIELD);
    SetSigns(blocks, &grid->tree());
    if (is_cut) {
      const Eigen::Vector3d low = (box.min() - lattice.origin) / lattice.voxel_size * world_voxel;
      const Eigen::Vector3d high = (box.max() - lattice.origin) / lattice.voxel_size * world_voxel;
      const auto box_grid = openvdb::tools::createLevelSetBox<openvdb::FloatGrid>(
          openvdb::math::BBox<openvdb::Vec3d>(openvdb::Vec3d(low.x(), low.y(), low.z()),
                                              openvdb::Vec3d(high.x(), high.y(), high.z())),
          *transform,
          kHalfWidth);
      openvdb::tools::csgIntersection(*grid, *box_grid);
    }
    openvdb::tools::pruneLevelSet(grid->tree());
  });
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
}

}  // namespace semfoam
