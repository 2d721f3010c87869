// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask/mask_rewriting.h"
#include "plugin/mask/masked_photos.h"

#include <filesystem>
#include <memory>
#include <vector>

namespace semfoam {

// Photos with the masks that the tracks of the model have corrected.
struct CorrectedPhotos {
  MaskedPhotos photos;
  // Null where the masks stay as they are.
  std::shared_ptr<const MaskRewriter> rewriter;

  // Decodes the corrected mask of a photo, in classes of MaskedPhotos::labels; empty without a
  // mask. Throws UserError as DecodeMaskAgain does.
  ClassImage Mask(int view) const;
};

// Reads the masks as LoadMaskedPhotos does, and keeps what corrects them. Throws UserError as that.
CorrectedPhotos LoadCorrectedPhotos(const Reconstruction& model,
                                    std::vector<PhotoRecord> photos,
                                    const MaskPairing& pairing,
                                    const std::filesystem::path& mask_folder,
                                    LabelZero label_zero,
                                    MaskConsistency consistency);

}  // namespace semfoam
