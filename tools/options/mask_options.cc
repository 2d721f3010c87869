// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/options/mask_options.h"

#include "foam/util/error.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/mask/mask_folders.h"
#include "plugin/mask/mask_tables.h"
#include "plugin/util/files.h"
#include "tools/controllers/training_run.h"

#include <vector>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// In the model's folder or one that holds it: W/object_mask for W/sparse/0.
fs::path FindMasksAbove(const fs::path& model_folder) {
  fs::path folder = fs::absolute(model_folder);
  for (int i = 0; i < 3; ++i) {
    fs::path masks = FindMaskFolder(folder);
    if (!masks.empty()) return masks;
    folder = ParentFolder(folder);
  }
  return {};
}

}  // namespace

LabelZero MaskOptions::Zero() const {
  return label_zero == "class"    ? LabelZero::kClass
         : label_zero == "ignore" ? LabelZero::kIgnore
                                  : LabelZero::kAuto;
}

MaskConsistency MaskOptions::Consistency() const {
  return ParseEnum(kMaskConsistencyNames, consistency).value_or(MaskConsistency::kAuto);
}

void AddMaskPathOptions(OptionManager* options, MaskOptions* masks) {
  options->AddDefaultOption("mask_path",
                            &masks->mask_path,
                            "the instance masks: a folder, in a training and for foam_labeler "
                            "also masks of any format that mask_importer reads; by default "
                            "object_mask/, then Annotations/");
  options->AddDefaultOption(
      "labels_path",
      &masks->labels_path,
      "names of the labels, {\"labels\": {\"7\": \"mug\"}}; by default labels.json in the "
      "masks' folder or beside it");
}

void AddMaskReadingOptions(OptionManager* options, MaskOptions* masks) {
  options->AddChoiceOption("FoamTraining.label_zero",
                           &masks->label_zero,
                           {"auto", "ignore", "class"},
                           "what id 0 of the masks is: unlabelled, or the class of what is no "
                           "object; auto = a class where it covers a fifth of the masks");
  options->AddChoiceOption("Masks.consistency",
                           &masks->consistency,
                           AllNames(kMaskConsistencyNames),
                           "what to do about errors of the masks: correct them by the SfM tracks, "
                           "or, where ids mean nothing from photo to photo, match them by these");
}

void RequireWorkspace(const fs::path& workspace_path) {
  if (fs::is_directory(workspace_path)) return;
  throw UserError(workspace_path.string(),
                  ": there is no such folder; --workspace_path takes the folder that holds "
                  "images/ and sparse/.");
}

MaskedModelPaths FindMaskedModel(const std::string& workspace_path,
                                 const std::string& input_path,
                                 const MaskOptions& masks,
                                 bool needs_model,
                                 bool needs_masks) {
  MaskedModelPaths paths;
  const fs::path workspace = workspace_path;
  if (!workspace.empty()) RequireWorkspace(workspace);
  if (!input_path.empty()) {
    paths.model_folder = FindModelFolder(input_path);
  } else if (!workspace.empty() && (needs_model || fs::is_directory(workspace / "sparse"))) {
    paths.model_folder = FindModelFolder(workspace / "sparse");
  } else if (needs_model) {
    throw UserError(
        "Failed to parse options - neither '--workspace_path' nor '--input_path' is given; one of "
        "them must name the COLMAP model.");
  }
  paths.mask_folder = masks.mask_path;
  if (paths.mask_folder.empty() && !workspace.empty()) {
    paths.mask_folder = FindMaskFolder(workspace);
  }
  if (paths.mask_folder.empty() && !paths.model_folder.empty()) {
    paths.mask_folder = FindMasksAbove(paths.model_folder);
  }
  if (paths.mask_folder.empty() && !needs_masks) return paths;
  if (paths.mask_folder.empty()) {
    const fs::path searched = workspace.empty() ? paths.model_folder : workspace;
    std::vector<fs::path> unused;
    if (!searched.empty()) unused = UnusedMaskFolders(searched);
    throw UserError(searched.empty() ? "Failed to parse options" : searched.string(),
                    searched.empty() ? " - neither" : ": neither",
                    " object_mask/ nor Annotations/ is there; --mask_path would name the folder "
                    "of the masks",
                    unused.empty() ? "." : ", perhaps " + unused[0].string() + ".");
  }
  paths.labels_file = FindLabelsFile(masks.labels_path, paths.mask_folder);
  return paths;
}

}  // namespace semfoam
