// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/object_surface.h"
#include "export/volume/vdb_grids.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include <openvdb/math/Proximity.h>
#include <openvdb/tools/Prune.h>

namespace semfoam {
namespace {

constexpr double kHalfWidth = 3;  // voxels
constexpr int64_t kTrianglesPerTask = 1024;
constexpr int64_t kLeavesPerTask = 16;

using Leaf = openvdb::FloatTree::LeafNodeType;
using Triangle = std::array<Eigen::Vector3d, 3>;  // index space

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

// Returns the triangles of a surface as far as they lie in `region`, index space.
std::vector<Triangle> SurfaceIn(const std::vector<Eigen::Vector3d>& vertices,
                                const std::vector<std::array<uint32_t, 3>>& faces,
                                const VoxelLattice& lattice,
                                const Eigen::AlignedBox3d& region) {
  std::vector<Triangle> triangles;
  std::vector<Eigen::Vector3d> polygon;
  for (const std::array<uint32_t, 3>& triangle : faces) {
    polygon.clear();
    Eigen::AlignedBox3d around;
    for (const uint32_t vertex : triangle) {
      polygon.push_back((vertices[vertex] - lattice.origin) / lattice.voxel_size);
      around.extend(polygon.back());
    }
    if (!region.contains(around)) ClipToBox(region, &polygon);
    for (size_t k = 2; k < polygon.size(); ++k) {
      triangles.push_back({polygon[0], polygon[k - 1], polygon[k]});
    }
  }
  return triangles;
}

// A block of 8^3 voxels and a triangle that may come nearer to it than the half width.
struct Near {
  uint64_t block;
  uint32_t triangle;
};

std::vector<Near> NearBlocks(const std::vector<Triangle>& triangles) {
  const int64_t count = std::ssize(triangles);
  std::vector<std::vector<Near>> parts((count + kTrianglesPerTask - 1) / kTrianglesPerTask);
  ParallelForBlocks(count, kTrianglesPerTask, [&](int64_t begin, int64_t end) {
    std::vector<Near>& part = parts[begin / kTrianglesPerTask];
    for (int64_t k = begin; k < end; ++k) {
      const auto& [a, b, c] = triangles[k];
      const Eigen::Array3d low = a.cwiseMin(b).cwiseMin(c).array() - kHalfWidth;
      const Eigen::Array3d high = a.cwiseMax(b).cwiseMax(c).array() + kHalfWidth;
      const Eigen::Vector3i first = (low / 8).floor().matrix().cast<int>();
      const Eigen::Vector3i last = (high / 8).floor().matrix().cast<int>();
      const Eigen::Vector3d normal = (b - a).cross(c - a);
      // From a block's centre to its farthest voxel, and the half width.
      const double reach = normal.norm() * (3.5 * std::sqrt(3.0) + kHalfWidth);
      for (int x = first.x(); x <= last.x(); ++x) {
        for (int y = first.y(); y <= last.y(); ++y) {
          for (int z = first.z(); z <= last.z(); ++z) {
            const Eigen::Vector3d center = 8 * Eigen::Vector3d(x, y, z).array() + 3.5;
            if (std::abs(normal.dot(center - a)) > reach * (1 + 1e-9)) continue;
            part.push_back({PackBlock({x, y, z}), static_cast<uint32_t>(k)});
          }
        }
      }
    }
  });
  std::vector<Near> all;
  for (const std::vector<Near>& part : parts) all.insert(all.end(), part.begin(), part.end());
  std::sort(all.begin(), all.end(), [](const Near& a, const Near& b) {
    return a.block != b.block ? a.block < b.block : a.triangle < b.triangle;
  });
  return all;
}

// Lowers the distances of a block's voxels to those from a triangle.
void LowerDistances(const Triangle& triangle,
                    const Eigen::Vector3i& origin,
                    std::array<double, 512>* distances) {
  // All relative to the block.
  const Eigen::Vector3d from = origin.cast<double>();
  const Eigen::Vector3d a = triangle[0] - from, b = triangle[1] - from, c = triangle[2] - from;
  const Eigen::Array3d lowest = a.cwiseMin(b).cwiseMin(c).array() - kHalfWidth;
  const Eigen::Array3d highest = a.cwiseMax(b).cwiseMax(c).array() + kHalfWidth;
  const Eigen::Vector3i low = lowest.ceil().max(0).matrix().cast<int>();
  const Eigen::Vector3i high = highest.floor().min(7).matrix().cast<int>();
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  const double normal_length = normal.norm();
  const Eigen::Vector3d middle = (a + b + c) / 3;
  const double radius = std::sqrt(std::max(
      {(a - middle).squaredNorm(), (b - middle).squaredNorm(), (c - middle).squaredNorm()}));
  const openvdb::Vec3d corner_a(a.x(), a.y(), a.z());
  const openvdb::Vec3d corner_b(b.x(), b.y(), b.z());
  const openvdb::Vec3d corner_c(c.x(), c.y(), c.z());
  for (int x = low.x(); x <= high.x(); ++x) {
    for (int y = low.y(); y <= high.y(); ++y) {
      const double plane_at_0 =
          normal.x() * (x - a.x()) + normal.y() * (y - a.y()) - normal.z() * a.z();
      const double aside =
          (x - middle.x()) * (x - middle.x()) + (y - middle.y()) * (y - middle.y());
      double* const row = &(*distances)[64 * x + 8 * y];
      for (int z = low.z(); z <= high.z(); ++z) {
        // Farther from the plane, or from the ball around the triangle, than what is known.
        if (std::abs(plane_at_0 + normal.z() * z) > row[z] * normal_length) continue;
        const double to_middle = aside + (z - middle.z()) * (z - middle.z());
        if (to_middle > (radius + row[z]) * (radius + row[z])) continue;
        const openvdb::Vec3d point(x, y, z);
        openvdb::Vec3d barycentric;
        const openvdb::Vec3d nearest = openvdb::math::closestPointOnTriangleToPoint(
            corner_a, corner_b, corner_c, point, barycentric);
        row[z] = std::min(row[z], (nearest - point).length());
      }
    }
  }
}

// Signed distance to a box, negative inside.
double DistanceToBox(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& point) {
  const Eigen::Vector3d beyond = (box.min() - point).cwiseMax(point - box.max());
  return beyond.cwiseMax(0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

// A block with triangles near it, or with voxels of the object, or both.
struct BandBlock {
  // PackBlock of the block.
  uint64_t key;
  std::span<const Near> near;
  // Null where the object holds none of the block.
  const VoxelBlock* cells;
};

// Joins the triangles near blocks and the object's voxels, both by ascending block. The result
// refers to both.
std::vector<BandBlock> JoinBlocks(std::span<const Near> near, std::span<const VoxelBlock> voxels) {
  std::vector<BandBlock> joined;
  for (size_t n = 0, k = 0; n < near.size() || k < voxels.size();) {
    const uint64_t of_near = n < near.size() ? near[n].block : UINT64_MAX;
    const uint64_t of_voxels = k < voxels.size() ? PackBlock(voxels[k].origin / 8) : UINT64_MAX;
    BandBlock block = {std::min(of_near, of_voxels), {}, nullptr};
    const size_t first = n;
    while (n < near.size() && near[n].block == block.key) ++n;
    block.near = near.subspan(first, n - first);
    if (of_voxels == block.key) block.cells = &voxels[k++];
    joined.push_back(block);
  }
  return joined;
}

// Returns the voxels of a block of the level set of what is in the object and in the box, index
// space.
std::unique_ptr<Leaf> MakeLeaf(const BandBlock& block,
                               const std::vector<Triangle>& triangles,
                               const Eigen::AlignedBox3d& index_box,
                               double voxel_size) {
  const float background = static_cast<float>(kHalfWidth * voxel_size);
  const Eigen::Vector3i origin = 8 * UnpackBlock(block.key);
  std::array<double, 512> distances;
  distances.fill(kHalfWidth);
  for (const Near& near : block.near) {
    LowerDistances(triangles[near.triangle], origin, &distances);
  }
  auto leaf = std::make_unique<Leaf>(
      openvdb::Coord(origin.x(), origin.y(), origin.z()), background, /*active=*/false);
  for (int voxel = 0; voxel < 512; ++voxel) {
    const bool inside = block.cells != nullptr && block.cells->cells[voxel] != kNoCell;
    const double to_surface = inside ? -distances[voxel] : distances[voxel];
    const Eigen::Vector3d point =
        (origin + Eigen::Vector3i(voxel >> 6, voxel >> 3 & 7, voxel & 7)).cast<double>();
    const double distance = std::max(to_surface, DistanceToBox(index_box, point));
    if (distance <= -kHalfWidth) {
      leaf->setValueOnly(voxel, -background);
    } else if (distance < kHalfWidth) {
      leaf->setValueOn(voxel, static_cast<float>(distance * voxel_size));
    }
  }
  return leaf;
}

}  // namespace

Eigen::AlignedBox3d LevelSetRegion(const VoxelLattice& lattice, const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return box;
  // What lies farther from the box than the half width changes no voxel of the band.
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(lattice.voxel_size * (kHalfWidth + 1));
  return {box.min() - margin, box.max() + margin};
}

openvdb::FloatGrid::Ptr MakeSurfaceLevelSet(const ExportableScene& scene,
                                            const ObjectInfo& object,
                                            const VoxelLattice& lattice,
                                            const Eigen::AlignedBox3d& box,
                                            double voxel_size) {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<VoxelBlock> inside;
  ObjectSurface surface;
  if (!box.isEmpty()) {
    surface = ExtractSurface(scene, object);
    for (const uint32_t tet : surface.vertex_tet) vertices.push_back(scene.voronoi_vertices[tet]);
    inside = VoxelizeCells(scene, object.cells, lattice, LevelSetRegion(lattice, box));
  }
  return MakeLevelSet(vertices, surface.triangles, inside, lattice, box, voxel_size);
}

openvdb::FloatGrid::Ptr MakeLevelSet(const std::vector<Eigen::Vector3d>& vertices,
                                     const std::vector<std::array<uint32_t, 3>>& triangles,
                                     const std::vector<VoxelBlock>& inside,
                                     const VoxelLattice& lattice,
                                     const Eigen::AlignedBox3d& box,
                                     double voxel_size) {
  InitializeOpenVdb();
  openvdb::FloatGrid::Ptr grid =
      openvdb::FloatGrid::create(static_cast<float>(kHalfWidth * voxel_size));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  if (box.isEmpty()) return grid;
  const auto to_index = [&](const Eigen::Vector3d& x) -> Eigen::Vector3d {
    return (x - lattice.origin) / lattice.voxel_size;
  };
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(kHalfWidth + 1);
  const Eigen::AlignedBox3d index_box(to_index(box.min()), to_index(box.max()));
  const Eigen::AlignedBox3d index_region(index_box.min() - margin, index_box.max() + margin);
  const std::vector<Triangle> clipped = SurfaceIn(vertices, triangles, lattice, index_region);
  const std::vector<Near> near = NearBlocks(clipped);

  const std::vector<BandBlock> band = JoinBlocks(near, inside);
  std::vector<std::unique_ptr<Leaf>> leaves(band.size());
  ParallelForBlocks(std::ssize(band), kLeavesPerTask, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k) {
      leaves[k] = MakeLeaf(band[k], clipped, index_box, voxel_size);
    }
  });
  for (std::unique_ptr<Leaf>& leaf : leaves) grid->tree().addLeaf(leaf.release());
  openvdb::tools::pruneLevelSet(grid->tree());
  return grid;
}

}  // namespace semfoam
