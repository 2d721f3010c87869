// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask/mask_classes.h"
#include "plugin/mask/mask_consistency.h"
#include "tools/cli/option_manager.h"

#include <filesystem>
#include <string>

namespace semfoam {

// Paths of masks and options of reading them, common to all commands.
struct MaskOptions {
  std::string mask_path;
  std::string labels_path;
  std::string label_zero = "auto";
  std::string consistency = "auto";

  LabelZero Zero() const;
  MaskConsistency Consistency() const;
};

// Adds --mask_path and --labels_path.
void AddMaskPathOptions(OptionManager* options, MaskOptions* masks);

// Adds --FoamTraining.label_zero and --Masks.consistency.
void AddMaskReadingOptions(OptionManager* options, MaskOptions* masks);

// The COLMAP model and the masks of a command that needs no photos.
struct MaskedModelPaths {
  // Empty: none.
  std::filesystem::path model_folder;
  // Empty: none, where they are not needed.
  std::filesystem::path mask_folder;
  // Empty: none.
  std::filesystem::path labels_file;
};

// Completes the paths of the user: the model is `input_path`, else the workspace's sparse/ (0/),
// else none if `needs_model` is false. Masks are `masks.mask_path`, else object_mask/, then
// Annotations/ in the workspace, or in a folder that holds the model, up to two above it, else none
// if `needs_masks` is false. Throws UserError, one sentence naming the option or folder, where
// something is missing.
MaskedModelPaths FindMaskedModel(const std::string& workspace_path,
                                 const std::string& input_path,
                                 const MaskOptions& masks,
                                 bool needs_model,
                                 bool needs_masks = true);

// Throws UserError where `workspace_path` is no folder.
void RequireWorkspace(const std::filesystem::path& workspace_path);

}  // namespace semfoam
