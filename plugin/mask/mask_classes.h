// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "foam/util/ids.h"
#include "plugin/mask/mask_decoding.h"
#include "plugin/mask/mask_pairing.h"

#include <filesystem>
#include <map>
#include <vector>

namespace semfoam {

// Numbers the ids of a set of masks as classes, 0, 1, ...

// The meaning of id 0 in the masks. Trackers write 0 where they track no object. If these pixels
// are small gaps, they are unlabelled (kIgnore). If few objects were masked and the rest is 0,
// these pixels show none of the objects, and must be a class of their own, or else everything would
// be learned as one of the objects (kClass). kAuto: a class if at least a fifth of the masks'
// pixels are 0, unless labels.json beside them says that these are unlabelled.
enum class LabelZero { kIgnore, kClass, kAuto };

// The classes of a set of masks.
struct MaskClasses {
  // One for each class, ascending by source id.
  std::vector<Label> labels;
  // Whether masks of colours are grey masks saved as RGB.
  bool colors_are_grey = false;
  std::map<MaskId, ClassIndex> class_of_id;

  // Returns the class of each of the mask's ids, for ClassesOf.
  std::vector<ClassIndex> Of(const MaskContents& mask) const;
};

// Numbers the ids of all masks as classes; `contents` [pairing.masks] are those of each mask.
//
// A pixel's id is: the value of a grey mask (1 to 16 bits); the index, never the colour, of a
// palette mask; R + 256 G + 65536 B of a colour mask (DEVA's long ids), unless no mask of the set
// has a pixel that is not grey: then they are grey masks saved as RGB. Alpha is ignored. Id 0 is no
// object: its pixels are kUnlabelled, or a class of their own (`label_zero`).
//
// Label::id is the mask's id where all ids of the set are at most 65535; else they are numbered
// from 1 in ascending order, and Label::source_id keeps the mask's.
//
// Throws UserError, one sentence naming the file: long ids that DEVA's pred.json, in the mask
// folder or beside it, does not have (a resampled mask); more than kMaxMaskClasses classes.
MaskClasses NumberMasks(const std::vector<MaskContents>& contents,
                        const MaskPairing& pairing,
                        const std::filesystem::path& mask_folder,
                        LabelZero label_zero);

}  // namespace semfoam
