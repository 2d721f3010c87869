// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/imported_masks.h"

#include <filesystem>
#include <vector>

namespace semfoam {

// Reads PNGs of ids as PairMasks and NumberMasks take them: grey, palette (as of DAVIS, YouTube-VOS
// and SAM 2) or the colours of DEVA. Ids are the same in all of `files`. A picture is named by its
// file below `folder`. Names come from labels.json in the folder or beside it, or from meta.json of
// YouTube-VOS up to two folders above. Throws UserError, one sentence naming the file, as
// DecodeMask and NumberMasks do, and where a table of names is damaged.
ImportedMasks ReadIdPngs(const std::filesystem::path& folder,
                         const std::vector<std::filesystem::path>& files);

}  // namespace semfoam
