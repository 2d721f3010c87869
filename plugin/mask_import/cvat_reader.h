// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/imported_masks.h"

#include <filesystem>

namespace semfoam {

// Reads the format "Segmentation mask" of CVAT, which is that of Pascal VOC: SegmentationClass/,
// SegmentationObject/ and labelmap.txt in `folder`. Without SegmentationObject/, each class of a
// photo is one region. Throws UserError, one sentence naming the file, where one is missing or
// damaged, or has a colour that labelmap.txt does not name.
ImportedMasks ReadCvat(const std::filesystem::path& folder);

}  // namespace semfoam
