// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/model/model.h"
#include "foam/util/ids.h"

#include <array>
#include <vector>

namespace semfoam {

using IdentityFeature = std::array<float, kIdentityDim>;

// Keeps only these classes (indices into Model::labels, each once), in this order, with their
// labels; a cell of another class gets the most likely class of those kept. Without classes the
// model has no semantics: identities and classifier are empty.
void KeepClasses(const std::vector<ClassIndex>& classes, Model* model);

// Replaces all classes: `labels` [K] are the new table, of which cell i gets class_of_cell[i]
// ([sites]; kUnlabelled: a class of id 0, unlabelled, which is added in front). Of up to
// kIdentityDim labels the features are perpendicular to each other, of more as different as can
// be found: a rendered feature belongs to the class that has clearly the most of the ray's weight
// (with up to kIdentityDim labels: the most), and to none where no class has a quarter. The softmax
// of a cell's class is near 1, as there is no doubt to express. CHECKs the sizes, that no label has
// id 0, and that the classes are in the table.
void SetClasses(std::vector<Label> labels,
                const std::vector<ClassIndex>& class_of_cell,
                Model* model);

// Adds a last class for cells that will be inserted, and returns the identity feature that they
// must have. The features of an inserted object come from another training and mean nothing to this
// classifier, so all its cells get this feature:
// - every cell of the model keeps its class, and all but one in a thousand keep their softmax to
//   about 1e-3: the longest features are shortened;
// - the returned feature belongs to the new class, and so does the identity rendered along a ray if
//   the feature has more than about half of the weight, for any other cells of the model.
// The feature lies in the direction that the model's own features and classes use least (the
// eigenvector of the smallest eigenvalue of their second moments), and has the minimum length, so
// that it barely shifts the other classes' logits where a ray crosses both. A model without
// semantics also gets a class of id 0, unlabelled, for the cells it has.
IdentityFeature AddClass(const Label& label, Model* model);

// Returns the label with an id that no label of `labels` has: its own, or else the smallest free
// one. Its name and the masks' id (Label::source_id) stay. Throws UserError when all of 1..65535
// are taken.
Label WithFreeId(const std::vector<Label>& labels, Label label);

}  // namespace semfoam
