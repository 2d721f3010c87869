// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/imported_masks.h"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace semfoam {

// Gives regions the ids of labels.

// What regions of one name in one photo are, where the format does not track them from photo to
// photo.
enum class SameName {
  kObjects,  // an object each: "chair_1", "chair_2", numbered photo by photo
  kOne       // parts of one object
};

struct NumberedRegions {
  // [pictures][regions] 1 to 65535.
  std::vector<std::vector<int32_t>> ids;
  // The name of each id; label_<id> where it has none.
  std::map<int32_t, std::string> names;
  // The format's own ids of tracked objects, by id, where objects are numbered anew.
  std::map<int32_t, int64_t> original_ids;
  // Whether no id means anything from photo to photo, as nothing has a name or is tracked.
  bool are_independent = false;
  // Names that several regions of a photo have, which are numbered photo by photo.
  std::vector<std::string> numbered;
};

// Numbers regions. Ids of a format that tracks its objects, and those of its names where each photo
// has one region of a name at most, are kept if they are 1 to 65535, each of one object; else
// objects are numbered 1, 2, ... in the order of ids and names. Regions with neither are numbered
// in each picture from 1 on. Throws UserError, naming `source`, where there are more than 65535.
NumberedRegions NumberRegions(const std::string& source,
                              const ImportedMasks& masks,
                              SameName same_name);

}  // namespace semfoam
