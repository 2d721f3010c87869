// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/mask/mask_suggestion.h"

#include <filesystem>
#include <vector>

namespace semfoam {

// What a foam does not know of its labels, and which photos would tell, as the parts of
// SuggestPhotosToMask: these are its cells.
struct UncertainCells {
  // [cells] From kLeastUncertainty to 1.
  std::vector<float> weight;
  // [photos] The cells that each photo shows.
  std::vector<std::vector<ShownPart>> shown_by;
};

// Uncertainty of a cell whose class is beyond doubt: labels that were spread over a thing that no
// mask shows may be sure of the wrong one.
inline constexpr float kLeastUncertainty = 0.25f;

// Uncertainty grows from kLeastUncertainty to 1 with the entropy of the classifier's softmax on the
// cell's identity, as a share of ln(classes); it is 1 for all cells of a foam without classes. Rays
// of a grid of pixels, 320 along a photo's longer side, show the cell in which their transmittance
// falls to 1/2, the depth of depth maps; n of them show 1 - 2^-n of it. So a cell counts once,
// however many pixels it covers. Takes 0.1 s of one core for each photo. The result is the same on
// any number of threads. Throws UserError naming `foam_path`, the file of the model, where a
// photo's record holds no valid camera.
UncertainCells FindUncertainCells(const Model& model, const std::filesystem::path& foam_path);

}  // namespace semfoam
