// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/colmap/colmap_model.h"
#include "plugin/dataset/scene_options.h"
#include "plugin/dataset/scene_plan.h"

#include <filesystem>

namespace semfoam {

// Chooses the photos of a scene: the registered images of the model, at the size that is trained
// on, and which of them are held out.

// Reads the photos' headers, in parallel. Fills photos, files, file_sizes, photo_decoding,
// num_unregistered, num_rescaled, num_reduced and distortion of the plan; the photos have the order
// of the model's images. `images_file`, where the model has them, is for messages. Throws what
// PlanScene throws about test_every, the model's images and the photos.
void ChoosePhotos(const SceneOptions& options,
                  const Reconstruction& model,
                  const std::filesystem::path& images_file,
                  ScenePlan* plan);

}  // namespace semfoam
