// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/masks/rendered_masks.h"

#include "foam/util/error.h"
#include "plugin/colmap/camera_rays.h"
#include "tools/images/view_images.h"

#include <memory>
#include <string>
#include <vector>

namespace semfoam {

void RequireMaskedPhotos(const Model& model, const std::filesystem::path& foam_path) {
  if (model.foam.HasSemantics() && !model.photos.empty()) return;
  throw UserError(foam_path.string(),
                  model.photos.empty()
                      ? ": has no photos, whose masks could be rendered; a foam as trained "
                        "would be right."
                      : ": has no labels, of which masks could be rendered; a foam trained with "
                        "masks would be right.");
}

size_t WriteRenderedMasks(const Model& model,
                          const std::filesystem::path& foam_path,
                          const ViewRenderer& renderer,
                          MaskOutput output,
                          const std::filesystem::path& output_path) {
  std::vector<std::string> names;
  for (const PhotoRecord& photo : model.photos) names.push_back(photo.name);
  const std::unique_ptr<MaskWriter> writer =
      MakeMaskWriter(output, output_path, names, model.labels);
  for (const PhotoRecord& photo : model.photos) {
    const RenderedView view =
        renderer.Render(MakeCameraRays(photo, model.world_from_normalized, foam_path));
    writer->Add(photo.name, LabelIdImage(view, model.labels));
  }
  writer->Finish();
  return names.size();
}

}  // namespace semfoam
