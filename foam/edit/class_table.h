// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"
#include "foam/model/model.h"
#include "foam/util/ids.h"

#include <array>
#include <vector>

namespace semfoam {

using IdentityFeature = std::array<float, kIdentityDim>;

// Keeps these classes (each once) in this order, with their labels; a cell of another class falls
// to the likeliest of those kept. Without classes the model has no semantics any more: identities
// and classifier are empty.
void KeepClasses(const std::vector<ClassIndex>& classes, Model* model);

// Adds one class, the last, for cells to come, and returns the identity feature that they are all
// to have. An inserted object brings features of another training, which this classifier knows
// nothing of, so it gets a new one:
// - every cell that the model has keeps its class, and its softmax to some 1e-3 (but for one in a
//   thousand whose features reach farthest: they are shortened, their classes stay);
// - the returned feature is of the new class, and so is what a ray gathers if that feature has more
//   than about half of its weight, whatever the other half is of this model's cells.
// It lies in the direction that the model's own features and classes use least (the eigenvector of
// the smallest eigenvalue of their second moments), and is no longer than it has to be, so that it
// hardly shifts the other classes' logits where a ray sees both. A model without semantics also
// gets a class of id 0, unlabelled, for the cells it has.
IdentityFeature AddClass(const Label& label, Model* model);

// The label as `labels` can take it: with its own id, or, where another label has that, with the
// smallest one that is free. Its name and the masks' id (Label::source_id) stay. Throws UserError
// when all of 1..65535 are taken.
Label WithFreeId(const std::vector<Label>& labels, Label label);

}  // namespace semfoam
