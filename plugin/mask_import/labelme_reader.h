// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/imported_masks.h"

#include <filesystem>
#include <vector>

namespace semfoam {

// Reads a JSON file of LabelMe: the shapes of one photo, polygons, rectangles, circles and masks;
// or a list of such photos, as the page of report_writer saves them. Shapes of one label and
// group_id are one region. Where a photo has points or lines, these are strokes, rectangles are
// boxes around objects, and all shapes of one label without a group_id are of one region. Returns
// none for another kind of file. Throws UserError, one sentence naming the file and the shape,
// where it is damaged.
std::vector<PictureContents> ReadLabelMe(const std::filesystem::path& file);

}  // namespace semfoam
