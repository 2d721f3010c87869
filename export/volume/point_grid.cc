// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/volume/vdb_grids.h"

#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/tools/PointIndexGrid.h>

namespace semfoam {
namespace {

template <typename Value>
void AddAttribute(const char* name,
                  const std::vector<Value>& data,
                  const openvdb::tools::PointIndexTree& order,
                  openvdb::points::PointDataTree* tree) {
  using namespace openvdb::points;
  appendAttribute<Value>(*tree, name);
  populateAttribute(*tree, order, name, PointAttributeVector<Value>(data));
}

}  // namespace

openvdb::points::PointDataGrid::Ptr MakePointGrid(
    const ExportableScene& scene,
    const std::vector<uint32_t>& cells,
    const std::vector<CellValues>& values,
    const VoxelLattice& lattice,
    const openvdb::math::Transform& world_from_index) {
  // All in index space, where numbers are small; the world comes in with the transform at the end.
  std::vector<openvdb::Vec3d> positions;
  std::vector<float> density, confidence, radius;
  std::vector<openvdb::Vec3s> color;
  std::vector<int32_t> labels, objects;
  for (const uint32_t cell : cells) {
    const Eigen::Vector3d p =
        (scene.cell_positions[cell].cast<double>() - lattice.origin) / lattice.voxel_size;
    positions.emplace_back(p.x(), p.y(), p.z());
    density.push_back(values[cell].density);
    confidence.push_back(values[cell].confidence);
    radius.push_back(scene.radius[cell] * static_cast<float>(scene.world_from_normalized.scale));
    color.push_back(values[cell].color);
    labels.push_back(Value(scene.label_id[cell]));
    objects.push_back(Value(scene.ObjectId(cell)));
  }
  const openvdb::math::Transform::Ptr identity =
      openvdb::math::Transform::createLinearTransform(1.0);
  const openvdb::points::PointAttributeVector<openvdb::Vec3d> sites(positions);
  const auto order =
      openvdb::tools::createPointIndexGrid<openvdb::tools::PointIndexGrid>(sites, *identity);
  auto grid = openvdb::points::createPointDataGrid<openvdb::points::NullCodec,
                                                   openvdb::points::PointDataGrid>(
      *order, sites, *identity);
  AddAttribute("density", density, order->tree(), &grid->tree());
  AddAttribute("color", color, order->tree(), &grid->tree());
  AddAttribute("label", labels, order->tree(), &grid->tree());
  AddAttribute("object", objects, order->tree(), &grid->tree());
  AddAttribute("confidence", confidence, order->tree(), &grid->tree());
  AddAttribute("radius", radius, order->tree(), &grid->tree());
  grid->setTransform(world_from_index.copy());
  return grid;
}

}  // namespace semfoam
