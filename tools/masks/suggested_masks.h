// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/mask/mask_suggestion.h"
#include "tools/options/mask_options.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Photos to mask next.
struct SuggestedMasks {
  // The names of the model's photos, sorted.
  std::vector<std::string> photos;
  // Whether they are found by a foam (UncertainCells), of which MaskSuggestion's shares are then of
  // what is uncertain; false: by the tracks.
  bool by_foam = false;
  int num_masks = 0;
  MaskSuggestion suggestion;
};

// Suggests up to `count` photos of the model. Every `test_every`-th photo by name, from the first
// on, will be held out of the training and is not suggested, nor does its mask count; 0: none.
// `paths.mask_folder` may be empty: no photo has a mask. Throws UserError where the model is
// damaged or has no points, and as PairMasks does.
SuggestedMasks SuggestMasks(const MaskedModelPaths& paths, int count, int test_every);

// Does the same by a foam that was trained with few masks or none: suggests photos that show what
// it is the least sure of (FindUncertainCells), none that it held out. `mask_folder` has the masks
// that there are; empty: none. Throws UserError as FindUncertainCells and PairMasks do, and where
// the foam, the content of `foam_path`, has no photos.
SuggestedMasks SuggestMasks(const Model& model,
                            const std::filesystem::path& foam_path,
                            const std::filesystem::path& mask_folder,
                            int count);

// Returns the suggestion in readable lines, and as JSON.
std::vector<std::string> SuggestionLines(const SuggestedMasks& masks);
std::string SuggestionJson(const SuggestedMasks& masks);

}  // namespace semfoam
