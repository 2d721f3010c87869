// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/imported_masks.h"

#include <filesystem>
#include <vector>

namespace semfoam {

// Reads COCO's instance annotations, {"images": [...], "annotations": [...], "categories": [...]},
// as CVAT, Roboflow, Label Studio and many others export them: polygons, and run lengths, raw or
// compressed. Annotations with a track_id, of their own or among their attributes, as CVAT writes
// it, are the same object in all images. Annotations without pixels (boxes, key points) are left
// out. Files are read one after another; points and run lengths stay in memory, in less than the
// files' size.
//
// Throws UserError, one sentence naming the file and the annotation: for a file that is damaged or
// of another form, numbers out of range, ids that no category or image has or that two have, and
// names that leave their folder.
ImportedMasks ReadCoco(const std::vector<std::filesystem::path>& files);

}  // namespace semfoam
