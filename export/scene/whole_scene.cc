// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/whole_scene.h"

namespace semfoam {

ExportableScene MakeWholeScene(Model model, ExportableSceneOptions options) {
  model.labels = {{LabelId{1}, MaskId{1}, kWholeSceneName}};
  Foam& foam = model.foam;
  foam.num_classes = 1;
  foam.identity.assign(foam.NumSites() * kIdentityDim, 0.f);
  foam.classifier_weight.assign(kIdentityDim, 0.f);
  foam.classifier_bias.assign(1, 0.f);
  options.min_component_share *= 0.1f;
  ExportableScene scene = MakeExportableScene(model, options);
  // It is no label of the user's.
  scene.labels_without_cells.clear();
  return scene;
}

}  // namespace semfoam
