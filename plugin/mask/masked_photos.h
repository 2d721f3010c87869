// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/colmap/tracks.h"
#include "plugin/mask/mask_consistency.h"
#include "plugin/mask/masks.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace semfoam {

// The registered images of a model with their masks, without photos and training. Keeps statistics
// of the masks only, not their pixels: a mask is decoded each time it is read.

// Returns the registered images as records, sorted by name, with the camera's size.
std::vector<PhotoRecord> RegisteredPhotos(const Reconstruction& model);

// Class of a mask at an observed pixel and UniformRadius around it; kUnlabelled and -1 outside of
// the photo or without a mask.
struct MaskObservation {
  int32_t given_class = kUnlabelled;  // in the mask as it is
  int32_t given_radius = -1;          // at most RaggedRadius
  int32_t corrected_class = kUnlabelled;
  int32_t corrected_radius = -1;  // at most SafeRadius
};

struct MaskedPhotos {
  std::vector<PhotoRecord> photos;    // as given, at the size at which the masks are read
  MaskPairing pairing;                // of the photos with their masks
  MaskClasses given;                  // of the masks as they are
  std::vector<Label> labels;          // of the masks held against the tracks: the corrected classes
  MaskConsistencyReport consistency;  // what that has come to
  std::vector<MaskContents> contents;              // [photos] of the masks at their own size
  std::vector<std::map<int32_t, int64_t>> pixels;  // [photos] by given class, without kUnlabelled
  // [points of the model] where the photos saw each, in pixels of the records' size, and what the
  // masks show there; none for a model that is null.
  std::vector<PixelObservations> observations;
  std::vector<std::vector<MaskObservation>> shown;
  std::string size_warning;  // MaskSizeWarning, for the sizes of the photos as given

  bool HasMask(int view) const { return !pairing.masks[view].empty(); }
  // Decodes the mask as it is given, at the record's size; empty without a mask. Throws UserError
  // as DecodeMaskAgain does.
  ClassImage GivenMask(int view) const;
};

// Looks at the masks of `photos`, which are RegisteredPhotos of `model`, and holds them against the
// model's tracks. A null model has no tracks: then masks are believed.
//
// Masks are read at the smaller size, the mask's or the camera's: none is blown up. Every one is
// decoded once, and where the model has points a second time: the tables above take 48 bytes for
// each observation, and of the masks one for each thread is in memory. Throws UserError as
// DecodeMask, NumberMasks, CorrectMasks and DecodeMaskAgain do, of several masks for the first.
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

// Fills `photos->shown`. Calls `masks_of` once for each view with observations, in parallel; throws
// what it throws.
void CollectObservations(const std::function<ViewMasks(int view)>& masks_of, MaskedPhotos* photos);

}  // namespace semfoam
