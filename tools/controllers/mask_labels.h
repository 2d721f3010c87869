// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/device.h"
#include "foam/model/model.h"
#include "foam/train/label_spreading.h"
#include "plugin/dataset/scene_options.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace semfoam {

// Labels for foams that are trained already, by masks of some of their photos or of all.

// Sets the options of `scene` by which photos and masks are read as in the training of `model`:
// test_every, random_seed (of the sample of the tracks that masks are corrected by),
// mask_consistency and max_image_size. A model that does not say (Model::options) leaves them as
// they are.
void TakeTrainingOptions(const Model& model, SceneOptions* scene);

// Replaces all labels of a model, the content of `foam_path`, by those of the masks of `options`,
// which are read as a training reads them, from any format (ImportMasksOf): their pixels vote in
// the cells that they show (MeasureLabels), and the votes are spread along the surfaces to all
// cells (SpreadLabels), as at the end of a training on few masks. Positions, densities and colours
// stay. Cameras are where the foam has them, refined poses too, whatever the frame of the COLMAP
// model. Masks of photos that are held out do not vote. Files that are needed on the way are in a
// ScratchFolder in `scratch_parent`. Logs what is found in the masks, and warnings.
//
// Throws UserError where no photo has a mask that votes, where the COLMAP model has a photo that
// the foam does not have, where the masks are of nothing that the foam shows, and whatever
// ImportMasksOf and LoadScene throw.
SpreadingResult LabelByMasks(const std::filesystem::path& foam_path,
                             const SceneOptions& options,
                             const Device& device,
                             const std::filesystem::path& scratch_parent,
                             Model* model);

// Warns of labels that are smaller than the cells (SpreadingResult::small_classes). `labels`
// [classes].
void WarnOfSmallLabels(const SpreadingResult& result, const std::vector<Label>& labels);

// Returns "mug, plant": the names of labels, or their ids, shortened where there are many.
std::string NamesOf(const std::vector<Label>& labels);

}  // namespace semfoam
