// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask/mask_classes.h"
#include "plugin/mask/mask_consistency.h"

#include <cstdint>
#include <filesystem>

namespace semfoam {

// Options of the photos and masks of a training.

// Whether an effect is simulated: as the probe of the photos finds (kAuto), always, or never.
enum class EffectSwitch { kAuto, kOn, kOff };

struct SceneOptions {
  // Folder that image names are relative to.
  std::filesystem::path image_path;
  // A COLMAP model, or a folder that FindModelFolder knows.
  std::filesystem::path input_path;
  // A dense point cloud in the frame of the model (ReadSeedCloud); empty: none.
  std::filesystem::path seed_path;
  // Folder of the masks; empty: what FindMaskFolder finds in workspace_path, then beside
  // image_path, if anything.
  std::filesystem::path mask_path;
  // Folder of binary masks of pixels that nothing is learned from (ReadIgnoredPixels); empty: none.
  std::filesystem::path ignore_path;
  // Whether they exclude what is not black.
  bool ignore_inverted = false;
  // Folder that may hold the masks; empty: none.
  std::filesystem::path workspace_path;
  // File of the labels' names; empty: labels.json beside the mask folder, if there is one.
  std::filesystem::path labels_path;
  // Distance between held-out photos, counted by name from the first photo on; 0 = hold out none.
  int test_every = 0;
  // The meaning of id 0 in the masks.
  LabelZero label_zero = LabelZero::kAuto;
  // How masks are corrected by the tracks.
  MaskConsistency mask_consistency = MaskConsistency::kAuto;
  // Longest side in pixels to which larger photos are reduced; -1 = keep their size.
  int max_image_size = -1;
  // Whether to read masks; false: train as if there were none.
  bool use_masks = true;
  // kAuto: treat cameras whose distortion moves no corner by kLeastDistortion as pinhole cameras.
  EffectSwitch distortion = EffectSwitch::kAuto;
  // Seed of the sample of tracks.
  uint64_t random_seed = 0;
};

// Least movement of a corner by the distortion that is simulated, in pixels.
inline constexpr double kLeastDistortion = 0.1;

}  // namespace semfoam
