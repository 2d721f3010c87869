// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/cell_labels.h"
#include "foam/model/model.h"
#include "foam/util/ids.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Extracts and removes objects (Semantic Foam, section 3.4). The caller chooses the cells of an
// object; the program chooses those that it exports (export/scene/exportable_scene.h). Everything
// is in the model's own normalised frame; frame, photos and options of the model stay.

// One object: its class, and its cells, ascending (indices of sites, also hidden ones of other
// classes). Objects of one call share no cell.
struct ObjectCells {
  // Index into Model::labels.
  ClassIndex class_index{0};
  std::vector<uint32_t> cells;
};

// Objects without the rest of their scene: their cells with all parameters, and the ring, the cells
// around them made empty. Because every neighbour of an object's cell is kept, each cell of an
// object keeps its exact shape, and its appearance where nothing else was in front of it. The label
// table holds only these objects, in the given order; hidden cells of other classes get the mean
// feature of their object's own cells, so that every cell of an object has its class.
struct ExtractedObjects {
  Model model;
  // [sites] Index into the objects of the call; -1: a ring cell.
  std::vector<int32_t> object_of_site;
};
ExtractedObjects ExtractObjects(const Model& model,
                                const Delaunay& delaunay,
                                const std::vector<ObjectCells>& objects);

// Returns the model without these objects. Their outermost cells are made empty and kept, and their
// inner cells are removed: because every neighbour of the other cells is kept, these keep their
// exact shape and do not extend into the hole. The labels are removed from the table; remaining
// cells of these classes get the next most likely one.
//
// Also makes empty the haze around an object, which has its colours: cells around the object, and
// cells of its class connected to them, that are not solid or that more light passes than they stop
// (CellStatistics). `is_in_object` [sites] is 1 for the cells of any object, these or others: cells
// of another object are not haze.
Model RemoveObjects(const Model& model,
                    const Delaunay& delaunay,
                    const CellLabels& cell_labels,
                    const std::vector<uint8_t>& is_in_object,
                    const std::vector<ObjectCells>& objects);

}  // namespace semfoam
