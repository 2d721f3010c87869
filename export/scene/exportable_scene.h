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
  // Of the largest by volume; where there is any.
  int64_t largest_cells = 0;
  double largest_volume = 0;
  Eigen::Vector3d largest_center = Eigen::Vector3d::Zero();  // its sites' mean, by volume
};

// A photo that shows an object.
struct PhotoObservation {
  std::string photo;   // the photo's name
  int64_t pixels = 0;  // that show the object, estimated from a grid of them; at least 1
};

// One segmented thing: the cells that carry its label, and what is known of it. Lengths, volumes
// and boxes are of the frame of the files: COLMAP's, unless a transform was asked for.
struct ObjectInfo {
  LabelId id = kNoObject;  // the label's, 1..65535
  std::string name;        // as people see it: "label_<id>" where the label has no name
  std::string file_stem;   // "<id>_<sanitised name>"
  std::array<uint8_t, 3> color = {0, 0, 0};            // LabelColor(id), display values
  std::vector<uint32_t> cells;                         // ascending
  double volume = 0;                                   // of all cells together, exact
  double area = 0;                                     // of their boundary, exact
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  // of their volume, exact
  Eigen::AlignedBox3d bounding_box;                    // of all cells together, corners included
  double confidence = 0;  // mean over the cells of the object's own class
  int components = 0;     // connected
  // Of the surface of its cells, see surface_topology.h.
  int64_t cavities = 0;        // closed inner shells
  int64_t genus = 0;           // tunnels
  LeftOutComponents left_out;  // see ExportableSceneOptions
  // The photos that show the object, by pixels, most first; empty until somebody has looked.
  std::vector<PhotoObservation> photos;
};

// A label whose object is left out as a whole, because of ComponentOptions.
struct LeftOutLabel {
  LabelId id = kNoObject;
  std::string name;  // as ObjectInfo's
  LeftOutComponents left_out;
  std::string reason;        // for people: "too few cells in every piece"
  bool is_fragment = false;  // see LeaveOutFragments
};

// Which connected components of an object are kept, once it owns the hidden space inside it.
struct ComponentOptions {
  // Those with at least so many cells; 0 = crumbs are left out by ExportableSceneOptions'
  // min_component_share instead, which does not count otherwise.
  int64_t min_cells = 0;
  int keep_largest = 0;  // of these the largest so many, by volume; 0 = all
  // Objects that are no more than traces of a wrong label (LeaveOutFragments) are kept, too. They
  // are with min_cells, whose rule then holds instead.
  bool keep_fragments = false;
};

struct ExportableSceneOptions {
  // Matter, not air: density * cell radius, both of the normalised frame, at least this.
  float solid_optical_depth = kSolidOpticalDepth;
  // A cell is photographed when some training ray gave it at least this rendering weight (0..1).
  // Without statistics in the model every cell counts as photographed.
  float photographed_contribution = 0.05f;
  // Crumbs: connected components of an object with fewer cells than this share of its largest
  // component are left out, 0..1; 0 keeps everything. A few wrongly labelled cells far off would
  // otherwise decide an object's box, volume and surface.
  float min_component_share = 0.1f;
  ComponentOptions components;
  // Let an object own the hidden space inside it (see MakeExportableScene).
  bool fill_hidden_space = true;
  // Rays say what a cell is from this many on (CellStatistics: passed + stopped); with fewer, it
  // counts as unseen.
  float fewest_looks = 20;
  // Where the files are to put the COLMAP frame.
  ExportTransform transform;
};

// Everything that the exporters read, computed once from a model. All per-cell arrays are indexed
// as the foam's sites; positions, densities and volumes are of the normalised frame.
struct ExportableScene {
  std::vector<Eigen::Vector3f> cell_positions;    // [N + guards]
  Delaunay delaunay;                              // of cell_positions
  std::vector<Eigen::Vector3d> voronoi_vertices;  // [tets]
  TetsOfCells tets_of_cells;

  std::vector<float> density;                  // [N], activated, per normalised unit
  std::vector<float> radius;                   // [N], see CellRadii
  std::vector<double> volume;                  // [N]
  CellLabels labels;                           // [N]
  std::vector<LabelId> label_id;               // [N] id of the cell's class, or kNoObject
  std::vector<Eigen::Vector3f> display_color;  // [N] what photos show: sRGB values in 0..1
  std::vector<float> color_weight;             // [N] how surely: see ColorWeights
  std::vector<uint8_t> photographed;           // [N]
  std::vector<int32_t> object_of_cell;         // [N] index into `objects`; -1 = none

  // The frame of the files. Its rotation comes last, after the similarity, which has none:
  // x_file = transform.rotation * world_from_normalized.Apply(x), see FileFromNormalized.
  // Without a transform world_from_normalized is the model's own, and the files' frame COLMAP's.
  ExportTransform transform;
  Similarity world_from_normalized;
  Similarity colmap_from_normalized;  // the model's own

  std::vector<Label> label_table;
  std::vector<ObjectInfo> objects;            // those with cells, by ascending id
  std::vector<Label> labels_without_cells;    // ids other than 0 for which no object was found
  std::vector<LeftOutLabel> labels_left_out;  // those whose objects are left out as a whole

  uint32_t NumSites() const { return delaunay.num_sites; }

  // Id of the object that a cell is part of; kNoObject: of none.
  LabelId ObjectId(uint32_t cell) const {
    return object_of_cell[cell] < 0 ? kNoObject : objects[object_of_cell[cell]].id;
  }

  Eigen::Vector3d FileFromNormalized(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d unturned = world_from_normalized.Apply(x);
    return transform.IsTurned() ? transform.rotation * unturned : unturned;
  }
};

// Prepares a model for export and finds its objects.
//
// The object of label k follows Semantic Foam's extraction rule: it is made of the solid cells
// whose own class is k, and the empty cells around them decide where it ends. Five rules refine
// it, because nobody has seen the inside of anything and no training labels every cell rightly:
// - Cells that nearly all of the photos' rays pass are haze, no matter, however dense.
// - Solid cells that no photo shows (density left over behind a surface) belong to the object only
//   if they hang together with a photographed cell of it; the others are no object at all.
// - Crumbs beside the object's large components are left out (`min_component_share`).
// - Unseen cells belong to the object where that makes its surface smaller (UnseenInside). So a
//   trained shell becomes a body, closed also where it stands on something.
// - A pocket of other cells that the object encloses completely, in which there is neither a
//   photographed solid cell nor a camera nor another object, is hidden inside the object and
//   belongs to it, seen or not (rays leak through thin shells). A room is not filled by its walls.
// `fill_hidden_space` switches the last two; the first and the fourth need a model that knows what
// rays passed and what stopped them. No cell belongs to two objects. The label of id 0 makes none.
//
// Then ComponentOptions may leave out more, by default fragments (LeaveOutFragments); the rest is
// measured (DescribeObject).
//
// The display colour of a cell is CellStatistics::mean_color where the model has statistics, else
// the view-independent part of its spherical harmonics, cut to 0..1. Cells of objects that are not
// photographed take theirs from those that are (SpreadColors).
//
// CHECKs that the model's arrays have the sizes that they promise.
ExportableScene MakeExportableScene(const Model& model, const ExportableSceneOptions& options = {});

// What an exporter wrote.
struct WrittenFile {
  LabelId object_id = kNoObject;  // kNoObject = the whole scene
  std::string format;   // its extension: "vdb", "nvdb", "om", "ply", "obj", "mtl", "glb", "usda"
  std::string path;     // relative to the output folder, with '/'
  std::string summary;  // what is in it, for the log: "1204 vertices, 2404 faces"
  std::string warning = {};  // what the user should know of it, or nothing
};

}  // namespace semfoam
