// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photo/photo.h"

#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Finds the mask of each photo by its name, and tells of masks that seem to be of other photos.

struct MaskPairing {
  // One for each photo; empty where it has none.
  std::vector<std::filesystem::path> masks;
  // Masks of none of the photos, sorted.
  std::vector<std::filesystem::path> unused;

  // Returns the number of photos with a mask.
  int NumPaired() const;
};

// Throws UserError, the sentence NoMaskIn, unless a photo has a mask.
void RequireMasks(const MaskPairing& pairing, const std::filesystem::path& mask_folder);

// Pairs the PNGs below `mask_folder` (sub-folders included, hidden files not) with the photos. The
// mask of `a/b.c.jpg` is the first there is of `a/b.c.jpg.png` (COLMAP's way), `a/b.c.png`,
// `a/b.png`, and the name less its last four characters (DEVA's way: `x.jpeg` has `x..png`).
// Throws UserError when two photos would share a mask, or when there are masks and none has a
// photo.
MaskPairing PairMasks(const std::filesystem::path& mask_folder,
                      const std::vector<std::string>& photo_names);

// Returns names for the masks of these photos, relative to their folder, with which PairMasks gives
// each photo its own: `a/b.png` for `a/b.jpg`. Where a photo would then get another one's, as of
// `a/b.jpg` and `a/b.png`, all are named as COLMAP names them, `a/b.jpg.png`. The photos' names
// must differ.
std::vector<std::string> NamesForMasks(const std::vector<std::string>& photo_names);

// Returns a sentence for the user about masks that seem to be of the photos before they were
// undistorted: larger or smaller than their photos by less than a tenth, as undistorting changes a
// photo and nobody reduces a mask. Read at the nearest pixel centre, they would lie beside what
// they show. Empty where there is none. `mask_sizes` and `photo_sizes` [pairing.masks] are those of
// the files; sizes of photos without a mask are not read.
std::string MaskSizeWarning(const MaskPairing& pairing,
                            const std::vector<PhotoSize>& mask_sizes,
                            const std::vector<PhotoSize>& photo_sizes);

}  // namespace semfoam
