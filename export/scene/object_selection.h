// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/scene/label_choice.h"

#include <string>
#include <vector>

namespace semfoam {

// The labels of a model that can be chosen: all but that of id 0.
std::vector<NamedLabel> NamedLabels(const std::vector<Label>& labels);

// What `choice` means among the objects of a scene. Throws UserError, with the objects that there
// are, where a text means none of them, and what ChooseLabels throws.
//
// Where `labels_without_object` is given, a label that exists and has no object (without solid
// cells, or left out) is no error but listed there, as "mug (7)", if it is among the ones to take.
LabelFilter FilterObjects(const ExportableScene& scene,
                          const LabelChoice& choice,
                          std::vector<std::string>* labels_without_object = nullptr);

// The objects that a filter has, by ascending id, each once.
std::vector<const ObjectInfo*> SelectObjects(const ExportableScene& scene,
                                             const LabelFilter& filter);
std::vector<const ObjectInfo*> SelectObjects(const ExportableScene& scene,
                                             const LabelChoice& choice);

// Whether a cell is meant: of an object, where the filter has that; of none, where the filter takes
// all but some objects and its own label is not one of these.
bool HasCell(const ExportableScene& scene, const LabelFilter& filter, uint32_t cell);

}  // namespace semfoam
