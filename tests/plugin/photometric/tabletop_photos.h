// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/dataset/training_scene.h"

#include <filesystem>

namespace semfoam {

inline std::filesystem::path TabletopPath() {
  return std::filesystem::path(SEMFOAM_TEST_DATA) / "tabletop";
}

// The photos of a workspace without masks, every eighth held out.
inline SceneOptions PhotosOf(const std::filesystem::path& workspace) {
  SceneOptions options;
  options.image_path = workspace / "images";
  options.input_path = workspace / "sparse/0";
  options.test_every = 8;
  options.use_masks = false;
  return options;
}

// Those of the tabletop in the repository, decoded once.
inline const TrainingScene& Tabletop() {
  static const TrainingScene scene(PlanScene(PhotosOf(TabletopPath())));
  return scene;
}

}  // namespace semfoam
