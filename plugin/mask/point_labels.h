// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask/masked_photos.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// What a point of the model is, by a vote of the masks over its track.
struct PointLabel {
  int32_t class_index = kUnlabelled;  // of MaskedPhotos::labels
  float confidence = 0;               // the label's share of all votes' weight, 0..1
};

// One label for each point of the model. Each observation votes for the class of its pixel in the
// corrected masks, with the product of two weights:
//
//   border  of a pixel that is d pixels from what is another class (at kSafeSide pixels a side, at
//           most kSafePixels): (d + 1/2) / (kSafePixels + 1/2), since borders are ragged and the
//           feature of an edge lies on either side;
//   trust   of the region that the pixel lies in: of the points in it that the other photos say
//           something of, the share that agrees, (agreeing + 1) / (judged + 2).
//
// Unlabelled pixels vote for nothing, as do photos without a mask: where a tracker has lost a thing
// it writes 0, which says nothing of the point. Where id 0 is a class it votes as any other. The
// heaviest class wins; of several that weigh the same, the first.
// A point that no mask shows is kUnlabelled with confidence 0.
std::vector<PointLabel> LabelPoints(const MaskedPhotos& photos);

}  // namespace semfoam
