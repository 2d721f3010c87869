// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask/mask_suggestion.h"
#include "tools/options/mask_options.h"

#include <string>
#include <vector>

namespace semfoam {

// Photos to mask next, before any training.
struct SuggestedMasks {
  // The names of the model's photos, sorted.
  std::vector<std::string> photos;
  int num_masks = 0;
  MaskSuggestion suggestion;
};

// Suggests up to `count` photos of the model. Every `test_every`-th photo by name, from the first
// on, will be held out of the training and is not suggested, nor does its mask count; 0: none.
// `paths.mask_folder` may be empty: no photo has a mask. Throws UserError where the model is
// damaged or has no points, and as PairMasks does.
SuggestedMasks SuggestMasks(const MaskedModelPaths& paths, int count, int test_every);

// Returns the suggestion in readable lines, and as JSON.
std::vector<std::string> SuggestionLines(const SuggestedMasks& masks);
std::string SuggestionJson(const SuggestedMasks& masks);

}  // namespace semfoam
