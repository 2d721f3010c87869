// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photo/photo.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Finds the mask of each photo by its name, and reports masks that seem to belong to other photos.

struct MaskPairing {
  // [photos] Mask of each photo; empty where it has none.
  std::vector<std::filesystem::path> masks;
  // Masks without a photo, sorted.
  std::vector<std::filesystem::path> unused;

  // Returns the number of photos with a mask.
  int NumPaired() const;
};

// Throws UserError with the sentence NoMaskIn unless a photo has a mask.
void RequireMasks(const MaskPairing& pairing, const std::filesystem::path& mask_folder);

// Pairs the PNGs below `mask_folder` (sub-folders included, hidden files not) with the photos. The
// mask of `a/b.c.jpg` is the first that exists of `a/b.c.jpg.png` (COLMAP's way), `a/b.c.png`,
// `a/b.png`, and the name less its last four characters (DEVA's way: `x.jpeg` has `x..png`). Throws
// UserError when two photos would share a mask, or when there are masks and none has a photo.
MaskPairing PairMasks(const std::filesystem::path& mask_folder,
                      const std::vector<std::string>& photo_names);

// Returns whether PairMasks would find the mask of at least one photo in the folder.
bool HavePhotos(const std::filesystem::path& mask_folder,
                const std::vector<std::string>& photo_names);

// Returns names for the masks of these photos, relative to their folder, with which PairMasks gives
// each photo its own mask: `a/b.png` for `a/b.jpg`. Where a photo would then get the mask of
// another one, as with `a/b.jpg` and `a/b.png`, all are named as COLMAP names them, `a/b.jpg.png`.
// The photos' names must differ.
std::vector<std::string> NamesForMasks(const std::vector<std::string>& photo_names);

// Returns whether two sizes differ as those of a photo before and after COLMAP's image_undistorter:
// each side by less than a tenth of `b`, whereas masks are usually reduced by more.
bool DifferAsByUndistortion(const PhotoSize& a, const PhotoSize& b);

// Returns a sentence for the user about masks that seem to be of the photos before they were
// undistorted (DifferAsByUndistortion). Read at the nearest pixel centre, they would be displaced
// from the objects that they show. Empty where there is none.
// `mask_sizes` and `photo_sizes` [pairing.masks] are those of the files; sizes of photos without a
// mask are not read.
std::string MaskSizeWarning(const MaskPairing& pairing,
                            const std::vector<PhotoSize>& mask_sizes,
                            const std::vector<PhotoSize>& photo_sizes);

}  // namespace semfoam
