// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/ids.h"
#include "plugin/mask/masked_photos.h"

#include <vector>

namespace semfoam {

// Labels the points of the model by a vote of the masks over their tracks.

struct PointLabel {
  // Index into MaskedPhotos::labels.
  ClassIndex class_index = kUnlabelled;
  // Share of the weight of all votes that the label has, 0..1.
  float confidence = 0;
};

// Returns the weight, 0..1, of a pixel whose square of this radius is all of one class
// (UniformRadius): borders are ragged, and what lies on the edge of an object is on either side.
float BorderWeight(int radius, const PhotoRecord& photo);

// Returns one label for each point of the model. Each observation votes for the class of its pixel
// in the corrected masks, with the product of two weights:
//
//   border  of a pixel that is d pixels from another class (at kSafeSide pixels a side, at most
//           kSafePixels): (d + 1/2) / (kSafePixels + 1/2), since borders are ragged and the feature
//           of an edge lies on either side;
//   trust   of the region that the pixel lies in: of the points in it for which the other photos
//           vote, the share that agrees, (agreeing + 1) / (judged + 2).
//
// Unlabelled pixels and photos without a mask do not vote: a tracker that has lost an object writes
// 0, which is no evidence about the point. Where id 0 is a class it votes like any other. The class
// with the greatest weight wins; ties: the first. A point without votes is kUnlabelled with
// confidence 0.
std::vector<PointLabel> LabelPoints(const MaskedPhotos& photos);

}  // namespace semfoam
