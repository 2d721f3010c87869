// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model.h"
#include "plugin/colmap_model.h"
#include "plugin/mask_consistency.h"
#include "plugin/masks.h"
#include "plugin/tracks.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// A model's registered images with their masks, for what needs neither photos nor training.

// The registered images as records, sorted by name; their size is the camera's.
std::vector<PhotoRecord> RegisteredPhotos(const Reconstruction& model);

struct MaskedPhotos {
  std::vector<PhotoRecord> photos;    // as given, at the size at which the masks are kept
  MaskSet given;                      // the masks as they are
  MaskSet corrected;                  // and held against the tracks
  MaskConsistencyReport consistency;  // what that has come to
  // [points of the model] where the photos saw each, in pixels of the records' size; none for a
  // model that is null.
  std::vector<Sightings> sightings;
  std::string size_warning;  // MaskSizeWarning, for the sizes of the photos as given
};

// Loads the masks of `photos`, which are RegisteredPhotos of `model`, and corrects a copy of them
// by the model's tracks. A null model has no tracks: then masks are believed.
//
// Masks are kept at the smaller size, the mask's or the camera's: a tracker's small masks of large
// photos take no more memory than they hold, and none is blown up. Throws UserError as LoadMasks
// and MakeMasksConsistent do.
MaskedPhotos LoadMaskedPhotos(const Reconstruction* model,
                              std::vector<PhotoRecord> photos,
                              const MaskPairing& pairing,
                              const std::filesystem::path& mask_folder,
                              LabelZero label_zero,
                              MaskConsistency consistency);

}  // namespace semfoam
