// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "foam/util/ids.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/colmap/tracks.h"
#include "plugin/mask/class_image.h"
#include "plugin/mask/mask_classes.h"
#include "plugin/mask/mask_consistency.h"
#include "plugin/mask/mask_decoding.h"
#include "plugin/mask/mask_pairing.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace semfoam {

// Loads the registered images of a model with their masks, without photos and training. Keeps
// statistics of the masks only, not their pixels: a mask is decoded each time it is read.

// Returns the registered images as records, sorted by name, with the camera's size.
std::vector<PhotoRecord> RegisteredPhotos(const Reconstruction& model);

// Class of a mask at an observed pixel and UniformRadius around it; kUnlabelled and -1 outside of
// the photo or without a mask.
struct MaskObservation {
  // In the original mask.
  ClassIndex given_class = kUnlabelled;
  // At most RaggedRadius.
  int32_t given_radius = -1;
  // In the corrected mask.
  ClassIndex corrected_class = kUnlabelled;
  // At most SafeRadius.
  int32_t corrected_radius = -1;
};

struct MaskedPhotos {
  // The photos, at the size at which the masks are read.
  std::vector<PhotoRecord> photos;
  // Masks of the photos.
  MaskPairing pairing;
  // Classes of the original masks.
  MaskClasses given;
  // Labels of the masks corrected by the tracks, one for each class.
  std::vector<Label> labels;
  MaskConsistencyReport consistency;
  // [photos] Contents of the masks at their own size.
  std::vector<MaskContents> contents;
  // [photos] Number of pixels by given class, without kUnlabelled.
  std::vector<std::map<ClassIndex, int64_t>> pixels;
  // [points of the model] Observations of each point, in pixels of the records' size, and the
  // classes of the masks there; empty without a model.
  std::vector<PixelObservations> observations;
  std::vector<std::vector<MaskObservation>> shown;
  // MaskSizeWarning for the sizes of the photos as given.
  std::string size_warning;

  bool HasMask(int view) const { return !pairing.masks[view].empty(); }
  // Decodes the mask as it is given, at the record's size; empty without a mask. Throws UserError
  // as DecodeMaskAgain does.
  ClassImage GivenMask(int view) const;
};

// Reads the masks of `photos`, which are RegisteredPhotos of `model`, and corrects them by the
// model's tracks. With a null model there are no tracks, and the masks are used as they are.
//
// Masks are read at the smaller one of their own and the camera's size: none is enlarged. Each is
// decoded once, and a second time where the model has points: the tables above take 48 bytes for
// each observation, and one mask for each thread is in memory. Throws UserError as DecodeMask,
// NumberMasks, CorrectMasks and DecodeMaskAgain do; if several masks are damaged, for the first.
MaskedPhotos LoadMaskedPhotos(const Reconstruction* model,
                              std::vector<PhotoRecord> photos,
                              const MaskPairing& pairing,
                              const std::filesystem::path& mask_folder,
                              LabelZero label_zero,
                              MaskConsistency consistency);

// Original and corrected mask of one photo, both of its size or both empty.
struct ViewMasks {
  ClassImage given;
  ClassImage corrected;
};

// Fills `photos->shown`. Calls `masks_of` once for each view with observations, in parallel, and
// rethrows its exceptions.
void CollectObservations(const std::function<ViewMasks(int view)>& masks_of, MaskedPhotos* photos);

}  // namespace semfoam
