// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/export_objects.h"

#include "export/scene/whole_scene.h"
#include "foam/util/error.h"
#include "tools/controllers/export_frame.h"
#include "tools/controllers/left_out_log.h"
#include "tools/controllers/object_photos.h"

namespace semfoam {

ExportableScene PrepareExport(const Model& model,
                              const std::filesystem::path& foam_path,
                              const FrameChoice& frame,
                              const ComponentOptions& components) {
  ExportableSceneOptions options;
  options.transform = FindFrame(model, frame, components);
  options.components = components;
  ExportableScene scene = MakeExportableScene(model, options);
  FindPhotosOfObjects(model, foam_path, &scene);
  LogLeftOut(scene);
  return scene;
}

bool IsWhole(const Model& model) { return !model.foam.HasSemantics(); }

ExportableScene PrepareWhole(const Model& model,
                             const ExportTransform& transform,
                             const ComponentOptions& components) {
  ExportableSceneOptions options;
  options.transform = transform;
  options.components = components;
  return MakeWholeScene(model, options);
}

void RequireObjects(const ExportableScene& scene, const std::filesystem::path& foam_path) {
  if (!scene.objects.empty()) return;
  if (!scene.labels_left_out.empty()) {
    throw UserError(
        foam_path.string(),
        ": all components of its objects are left out, so there is no surface to write; a "
        "smaller ",
        Field{"min_cells"},
        " would be right.");
  }
  if (!scene.labels_without_cells.empty()) {
    throw UserError(foam_path.string(),
                    ": none of its ",
                    scene.labels_without_cells.size(),
                    " labels has solid cells, so there is no surface to write; a longer training "
                    "would be right, or volume_exporter, which writes the whole scene.");
  }
  throw UserError(
      foam_path.string(),
      ": nothing in it is solid, so there is no surface to write; a longer training would "
      "be right.");
}

}  // namespace semfoam
