// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/scene/label_choice.h"
#include "foam/edit/object_editing.h"
#include "foam/model/cell_labels.h"
#include "foam/model/model.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Selects the objects that an edit works on, as cells (foam/edit/object_editing.h).

// Selected objects of a model.
struct ChosenObjects {
  // Triangulation of the model, and the labels of its cells.
  Delaunay delaunay;
  CellLabels cell_labels;
  // [sites] Whether the cell belongs to any object, selected or not.
  std::vector<uint8_t> is_in_object;
  std::vector<ObjectCells> objects;
  // "mug (6)", one per object.
  std::vector<std::string> names;
  // Number of cells of all selected objects.
  size_t num_cells = 0;
};

// Returns the options of exports, but with fragments, so that fragments can be selected by name.
ExportableSceneOptions EveryObject();

// Returns the scene of a model with every object. Throws UserError where the model, the content of
// `foam_path`, has no objects.
ExportableScene SceneWithObjects(const Model& model, const std::filesystem::path& foam_path);

// Takes the objects that a filter selects out of the scene of a model.
ChosenObjects TakeObjects(const Model& model, const LabelFilter& filter, ExportableScene scene);

// Finds the objects that `choice` names (SelectObjects). Throws UserError when one does not exist,
// or the model has no objects.
ChosenObjects ChooseObjects(const Model& model,
                            const LabelChoice& choice,
                            const std::filesystem::path& foam_path);

}  // namespace semfoam
