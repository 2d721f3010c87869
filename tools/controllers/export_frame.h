// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/scene/frame_choice.h"
#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"

namespace semfoam {

// Completes the frame of files (CompleteFrame) by the photos of a model and, to level by a plane,
// the surface of its cells (LevelSurface): then the model is made a scene for this alone. Logs by
// how much it was turned, how well the plane or the reference positions fit, and the tilt that
// remains. Throws as CompleteFrame and LevelSurface do.
ExportTransform FindFrame(const Model& model,
                          const FrameChoice& choice,
                          const ComponentOptions& components = {});

// Does the same by the images and points of a COLMAP model.
ExportTransform FindFrame(const Reconstruction& reconstruction, const FrameChoice& choice);

}  // namespace semfoam
