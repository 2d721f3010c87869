// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/cell_labels.h"
#include "foam/model/model.h"
#include "foam/util/ids.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Objects out of a foam (Semantic Foam, section 3.4). Which cells an object is made of is the
// caller's to say; the program takes those that it exports (export/scene/exportable_scene.h).
// Everything is in the model's own normalised frame, and frame, photos and options of the model
// stay.

// One object: its class, and its cells, ascending (indices of sites, also hidden ones of other
// classes). Objects of one call share no cell.
struct ObjectCells {
  ClassIndex class_index{0};
  std::vector<uint32_t> cells;
};

// Objects by themselves. Their cells, with all that they have, and the ring: the cells around them,
// made empty. As no neighbour of an object's cell is missing, each has exactly the shape that it
// had, and looks as it did where nothing else was before it. The label table holds these objects
// alone, in the order given; hidden cells of other classes get the mean feature of their object's
// own cells, so that every cell of an object is of its class.
struct ExtractedObjects {
  Model model;
  std::vector<int32_t> object_of_site;  // [sites] index into the objects of the call; -1 = ring
};
ExtractedObjects ExtractObjects(const Model& model,
                                const Delaunay& delaunay,
                                const std::vector<ObjectCells>& objects);

// The model without these objects. Their outermost cells stay as guards, made empty, and the inner
// ones go: as no neighbour of a cell of anything else is missing, each keeps exactly the shape that
// it had, and nothing grows into the hole. The labels are gone from the table, and what crumbs
// still had them falls to the next likely one.
//
// The haze around an object shows its colours and would stay as dust. It is made empty, too: cells
// around the object, and from there on cells of its class, that are not solid, or that more of the
// light passes than ends in (CellStatistics). `is_in_object` [sites] is 1 for the cells of any
// object, these or others: what is another's is no haze of this one.
Model RemoveObjects(const Model& model,
                    const Delaunay& delaunay,
                    const CellLabels& cell_labels,
                    const std::vector<uint8_t>& is_in_object,
                    const std::vector<ObjectCells>& objects);

}  // namespace semfoam
