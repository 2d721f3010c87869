// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/geometry/delaunay.h"
#include "foam/model/model.h"
#include "foam/util/ids.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Edits which label the cells of a trained model have. Only identities and the label table change:
// positions, densities and colours stay. CHECKs that a model has semantics, and that classes are in
// its table.

// Returns the class of each cell, the argmax of the classifier on its identity.
std::vector<ClassIndex> ClassesOfCells(const Foam& foam);

// Gives these cells a class that other cells have: those of another class get the mean feature of
// the class's cells, which is of that class because a linear classifier's classes are convex.
void GiveCells(const std::vector<uint32_t>& cells, ClassIndex class_index, Model* model);

// Gives these cells a new label (AddClass), which becomes the last class of the table.
void GiveCellsNewLabel(const std::vector<uint32_t>& cells, const Label& label, Model* model);

// Gives all cells of `from` the class `into`, and takes the label of `from` out of the table.
void MergeClass(ClassIndex from, ClassIndex into, Model* model);

// Makes all cells of a class unlabelled, and takes its label out of the table: they get the class
// of id 0, which is added where there is none.
void DropClass(ClassIndex class_index, Model* model);

// Returns the connected components of a set of cells, over the faces between them: the largest
// first, of equally large ones that with the lowest cell; the cells of each ascending.
std::vector<std::vector<uint32_t>> ComponentsOf(const std::vector<uint32_t>& cells,
                                                const Delaunay& delaunay);

}  // namespace semfoam
