// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/cell_labels.h"
#include "foam/model/model.h"

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The cells that photos show and that border on air, with the faces between them. Normalised frame.
struct SurfaceGraph {
  // [nodes] Indices of the cells, ascending.
  std::vector<uint32_t> cells;
  // [sites] Index of the cell's node; -1: none.
  std::vector<int32_t> node_of_cell;
  // [nodes] Site and radius (CellRadii) of the cell.
  std::vector<Eigen::Vector3f> positions;
  std::vector<float> radii;
  // [nodes] Unit length, out of the matter: the direction of the faces to air, by their area,
  // smoothed over neighbours that look the same way.
  std::vector<Eigen::Vector3f> normals;
  // [nodes] How much photos show of the cell, > 0: the number of rays that end in it
  // (CellStatistics::stopped), at most 20 times the median, so that few cells close to a camera do
  // not outweigh the rest.
  std::vector<float> weights;
  // [nodes] Display values, as the photos show the cell.
  std::vector<Eigen::Vector3f> colors;
  // CSR: the neighbours of node i are neighbors[offsets[i]] .. neighbors[offsets[i + 1]],
  // ascending; face_areas is aligned with them. A face counts as no larger than the disc with the
  // radius of the smaller cell: cells at the rim of what photos show have huge ones.
  std::vector<uint32_t> offsets;
  std::vector<uint32_t> neighbors;
  std::vector<float> face_areas;

  size_t NumNodes() const { return cells.size(); }
  std::span<const uint32_t> Neighbors(uint32_t node) const {
    return {neighbors.data() + offsets[node], neighbors.data() + offsets[node + 1]};
  }
  std::span<const float> FaceAreasOf(uint32_t node) const {
    return {face_areas.data() + offsets[node], face_areas.data() + offsets[node + 1]};
  }
  // Sums of `weights`, in the order of the nodes: of some of them, of all.
  double WeightOf(std::span<const uint32_t> nodes) const;
  double TotalWeight() const;
};

// Builds the graph. A cell is matter if it is solid (LabelCells) and no haze (IsHaze); a node is
// matter with a rendering weight of at least 0.05 in some photo, and has faces to what is no matter
// that do not look all ways alike. `delaunay` is the triangulation of the model's sites and the
// guards. CHECKs that the model has all CellStatistics.
SurfaceGraph BuildSurfaceGraph(const Model& model,
                               const Delaunay& delaunay,
                               const CellLabels& labels);

// Returns the connected components of the nodes for which `is_in` [nodes] is set, each ascending,
// by their lowest node.
std::vector<std::vector<uint32_t>> ComponentsOfNodes(const SurfaceGraph& graph,
                                                     const std::vector<uint8_t>& is_in);

}  // namespace semfoam
