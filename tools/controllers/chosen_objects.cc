// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/chosen_objects.h"

#include "export/scene/object_selection.h"
#include "foam/util/error.h"

#include <algorithm>
#include <utility>

namespace semfoam {

namespace fs = std::filesystem;

ExportableSceneOptions EveryObject() {
  ExportableSceneOptions options;
  options.components.keep_fragments = true;
  return options;
}

ExportableScene SceneWithObjects(const Model& model, const fs::path& foam_path) {
  ExportableScene scene = MakeExportableScene(model, EveryObject());
  if (scene.objects.empty()) {
    throw UserError(foam_path.string(),
                    ": has no objects; a foam has them where it was trained with instance masks.");
  }
  return scene;
}

ChosenObjects TakeObjects(const Model& model, const LabelFilter& filter, ExportableScene scene) {
  ChosenObjects chosen;
  for (const ObjectInfo* object : SelectObjects(scene, filter)) {
    ObjectCells& cells = chosen.objects.emplace_back();
    const auto label = std::find_if(model.labels.begin(),
                                    model.labels.end(),
                                    [&](const Label& one) { return one.id == object->id; });
    cells.class_index = static_cast<ClassIndex>(label - model.labels.begin());
    cells.cells = object->cells;
    chosen.names.push_back(object->name + " (" + std::to_string(Value(object->id)) + ")");
    chosen.num_cells += object->cells.size();
  }
  for (const int32_t object : scene.object_of_cell) chosen.is_in_object.push_back(object >= 0);
  chosen.delaunay = std::move(scene.delaunay);
  chosen.cell_labels = std::move(scene.labels);
  return chosen;
}

ChosenObjects ChooseObjects(const Model& model,
                            const LabelChoice& choice,
                            const fs::path& foam_path) {
  ExportableScene scene = SceneWithObjects(model, foam_path);
  const LabelFilter filter = FilterObjects(scene, choice);
  return TakeObjects(model, filter, std::move(scene));
}

}  // namespace semfoam
