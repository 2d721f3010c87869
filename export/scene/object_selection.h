// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/scene/label_choice.h"

#include <string>
#include <vector>

namespace semfoam {

// Returns the labels of a model that can be selected: all but that of id 0.
std::vector<NamedLabel> NamedLabels(const std::vector<Label>& labels);

// Returns the features of the label of an object in the scene; none of an id that has no label.
LabelFeatures FeaturesOf(const ExportableScene& scene, LabelId id);

// Returns the filter for a choice among the objects of a scene. Throws UserError, listing the
// existing objects, where a text selects none of them, and what ChooseLabels throws.
//
// If `labels_without_object` is given, a selected label that exists but has no object (without
// solid cells, or left out) is no error, but appended there as "mug (7)".
LabelFilter FilterObjects(const ExportableScene& scene,
                          const LabelChoice& choice,
                          std::vector<std::string>* labels_without_object = nullptr);

// Returns the objects that a filter selects, by ascending id, each once.
std::vector<const ObjectInfo*> SelectObjects(const ExportableScene& scene,
                                             const LabelFilter& filter);
std::vector<const ObjectInfo*> SelectObjects(const ExportableScene& scene,
                                             const LabelChoice& choice);

// Returns whether a filter selects a cell. It selects the cells of the objects that it has; and,
// unless it names objects to select, also the cells without an object whose own label is not
// excluded.
bool HasCell(const ExportableScene& scene, const LabelFilter& filter, uint32_t cell);

}  // namespace semfoam
