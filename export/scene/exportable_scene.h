// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/export_transform.h"
#include "foam/geometry/delaunay.h"
#include "foam/geometry/similarity.h"
#include "foam/model/cell_labels.h"
#include "foam/model/model.h"
#include "foam/util/ids.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace semfoam {

// Components that the rules leave out of an object.
struct LeftOutComponents {
  int64_t components = 0;
  int64_t cells = 0;
  double volume = 0;
  // The largest of them by volume, if there is any.
  int64_t largest_cells = 0;
  double largest_volume = 0;
  // Mean of its sites, weighted by volume.
  Eigen::Vector3d largest_center = Eigen::Vector3d::Zero();
};

// A photo that shows an object.
struct PhotoObservation {
  // Name of the photo.
  std::string photo;
  // Number of pixels that show the object, estimated from a grid of pixels; at least 1.
  int64_t pixels = 0;
};

// One segmented object: its cells and its properties. Lengths, volumes and boxes are in the frame
// of the files: COLMAP's, unless ExportTransform sets another.
struct ObjectInfo {
  LabelId id = kNoObject;  // the label's id, 1..65535
  // Name for display: "label_<id>" if the label has no name.
  std::string name;
  // "<id>_<sanitised name>".
  std::string file_stem;
  // LabelColor(id), display values.
  std::array<uint8_t, 3> color = {0, 0, 0};
  // Indices of its cells, ascending.
  std::vector<uint32_t> cells;
  // Volume of the union of its cells, and area of the boundary of that, exact.
  double volume = 0;
  double area = 0;
  // Centroid of the volume, exact.
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  // Box of all cells with their corners.
  Eigen::AlignedBox3d bounding_box;
  // Mean over the cells of the object's own class.
  double confidence = 0;
  // Number of connected components.
  int components = 0;
  // Numbers of closed inner shells and of tunnels of its surface (surface_topology.h).
  int64_t cavities = 0;
  int64_t genus = 0;
  // Components left out by ExportableSceneOptions.
  LeftOutComponents left_out;
  // The photos that show the object, in descending order of pixels; empty until they are computed.
  std::vector<PhotoObservation> photos;
};

// A label whose object is left out as a whole, because of ComponentOptions.
struct LeftOutLabel {
  LabelId id = kNoObject;
  // ObjectInfo::name.
  std::string name;
  LeftOutComponents left_out;
  // Reason for the user: "too few cells in every piece".
  std::string reason;
  // Whether it is a fragment (LeaveOutFragments).
  bool is_fragment = false;
};

// Options that select the connected components of an object, after the hidden space inside it was
// added.
struct ComponentOptions {
  // Minimum number of cells of a component; 0: use ExportableSceneOptions::min_component_share,
  // which is ignored otherwise.
  int64_t min_cells = 0;
  // Maximum number of components, the largest by volume; 0: all.
  int keep_largest = 0;
  // Whether to keep objects that are only traces of a wrong label (LeaveOutFragments). They are
  // also kept if min_cells is set, which then decides instead.
  bool keep_fragments = false;
};

struct ExportableSceneOptions {
  // Threshold of density * cell radius, both of the normalised frame, from which on a cell is
  // matter, not air.
  float solid_optical_depth = kSolidOpticalDepth;
  // Minimum rendering weight (0..1) in any training ray for a cell to be photographed. Without
  // statistics in the model every cell counts as photographed.
  float photographed_contribution = 0.05f;
  // Minimum number of cells of a connected component, as a share of the object's largest component,
  // 0..1; 0: keep all. Without this, a few wrongly labelled cells far away would determine an
  // object's box, volume and surface.
  float min_component_share = 0.1f;
  ComponentOptions components;
  // Whether to add to an object the hidden space inside it (see MakeExportableScene).
  bool fill_hidden_space = true;
  // Minimum number of rays (CellStatistics: passed + stopped) for a cell to count as seen.
  float fewest_looks = 20;
  // Transform from the COLMAP frame to the files.
  ExportTransform transform;
};

// All data that the exporters read, computed once from a model. Per-cell arrays are indexed by
// site; positions, densities and volumes are in the normalised frame.
struct ExportableScene {
  // [N + guards]
  std::vector<Eigen::Vector3f> cell_positions;
  // Triangulation of cell_positions.
  Delaunay delaunay;
  // [tets]
  std::vector<Eigen::Vector3d> voronoi_vertices;
  TetsOfCells tets_of_cells;
  // FaceAreas, aligned with delaunay.neighbors; normalised frame.
  std::vector<double> face_areas;

  // [N] After the activation, per normalised unit.
  std::vector<float> density;
  // [N] CellRadii.
  std::vector<float> radius;
  // [N] CellVolumes.
  std::vector<double> volume;
  // [N] Class, confidence and solidity.
  CellLabels labels;
  // [N] Id of the label of the cell's class; kNoObject: none.
  std::vector<LabelId> label_id;
  // [N] Colour in the photos: sRGB values in 0..1.
  std::vector<Eigen::Vector3f> display_color;
  // [N] ColorWeights.
  std::vector<float> color_weight;
  // [N] Whether the cell is photographed.
  std::vector<uint8_t> photographed;
  // [N] CellStatistics::passed and stopped; empty without them.
  std::vector<float> passed;
  std::vector<float> stopped;
  // [N] Whether at least ExportableSceneOptions::fewest_looks rays have looked at the cell; all 1
  // without CellStatistics::passed and stopped.
  std::vector<uint8_t> seen;
  // [N] Whether photos look through the cell: rays cross it before they have met their surface
  // (CellStatistics::passed of at least 1). All 0 without CellStatistics::passed.
  std::vector<uint8_t> crossed;
  // [N] Whether the cell is matter: solid, and no haze that nearly all rays pass.
  std::vector<uint8_t> is_matter;
  // [N] Index into `objects`; -1: none.
  std::vector<int32_t> object_of_cell;

  // The frame of the files. The rotation is applied last, after the similarity, which has none:
  // x_file = transform.rotation * world_from_normalized.Apply(x), see FileFromNormalized. Without a
  // transform world_from_normalized is the model's own, and the files' frame COLMAP's.
  ExportTransform transform;
  Similarity world_from_normalized;
  // Model::world_from_normalized.
  Similarity colmap_from_normalized;

  std::vector<Label> label_table;
  // Objects with cells, by ascending id.
  std::vector<ObjectInfo> objects;
  // Labels other than that of id 0 without an object.
  std::vector<Label> labels_without_cells;
  // Labels whose objects are left out as a whole.
  std::vector<LeftOutLabel> labels_left_out;

  uint32_t NumSites() const { return delaunay.num_sites; }

  // Returns the id of the object that a cell is part of; kNoObject: none.
  LabelId ObjectId(uint32_t cell) const {
    return object_of_cell[cell] < 0 ? kNoObject : objects[object_of_cell[cell]].id;
  }

  Eigen::Vector3d FileFromNormalized(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d unturned = world_from_normalized.Apply(x);
    return transform.IsTurned() ? transform.rotation * unturned : unturned;
  }
  Eigen::Vector3d ColmapFromFile(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d unturned = transform.IsTurned() ? transform.rotation.transpose() * x : x;
    return colmap_from_normalized.Apply(world_from_normalized.Invert(unturned));
  }
};

// Prepares a model for export and finds its objects.
//
// The object of label k follows Semantic Foam's extraction rule: it consists of the solid cells
// whose own class is k, and the empty cells around them bound it. Five rules refine it, because
// photos do not show the inside of objects, and training labels some cells wrongly:
// - Cells that nearly all of the photos' rays pass are haze, not matter, however dense.
// - Solid cells that no photo shows (density left over behind a surface) belong to the object only
//   if they are connected to a photographed cell of it; the others belong to no object.
// - Components much smaller than the object's largest one are left out (`min_component_share`).
// - Unseen cells belong to the object where that makes its surface smaller (UnseenInside). So a
//   trained shell is completed to a body, closed also where it touches another object.
// - A pocket of other cells that the object encloses completely, in which there is neither a
//   photographed solid cell nor a camera nor another object, is hidden inside the object and
//   belongs to it, seen or not (rays leak through thin shells). A room is not filled by its walls.
// `fill_hidden_space` controls the last two rules; the first and the fourth need
// CellStatistics::passed and stopped. No cell belongs to two objects. The label of id 0 has no
// object.
//
// Then ComponentOptions may leave out more, by default fragments (LeaveOutFragments); the rest is
// measured (DescribeObject).
//
// The display colour of a cell is CellStatistics::mean_color where the model has statistics, else
// the view-independent part of its spherical harmonics, clipped to 0..1. Cells of objects that are
// not photographed get colours from those that are (SpreadColors).
//
// CHECKs the sizes of the model's arrays.
ExportableScene MakeExportableScene(const Model& model, const ExportableSceneOptions& options = {});

// A file that an exporter has written.
struct WrittenFile {
  LabelId object_id = kNoObject;  // kNoObject: the whole scene
  // Its extension: "vdb", "nvdb", "om", "ply", "obj", "mtl", "glb", "usda".
  std::string format;
  // Path relative to the output folder, with '/'.
  std::string path;
  // Content, for the log: "1204 vertices, 2404 faces".
  std::string summary;
  // Warning for the user; empty: none.
  std::string warning = {};
};

}  // namespace semfoam
