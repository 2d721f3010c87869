// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/metrics.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace semfoam {

// How well label renders agree with exact masks, by two readings of the same renders:
//   direct  the object's own id is what should be rendered;
//   prompt  the protocol of Semantic Foam's evaluation: in the object's first view, every label
//           more than half of whose pixels lie inside the mask is taken for the object; where none
//           does, the label with the most pixels inside.
// A score is a mean over the views in which the object is seen.
struct LabelScore {
  double iou = 0;     // intersection over union, 0..1
  double recall = 0;  // share of the mask that is covered, 0..1
};

// One view of one object: what was rendered and where the object truly is (non-zero). Same size.
struct MaskedView {
  const LabelImage* rendered = nullptr;
  LabelImage mask;
};

struct ObjectScore {
  std::vector<int32_t> prompt_labels;  // ascending
  LabelScore prompt;
  std::optional<LabelScore> direct;  // where the object's id is known
  int num_views = 0;                 // views in which the mask is not empty
};

// Views in order; the first one with a mask that is not empty is the prompt. Nothing where no view
// has any. CHECKs equal sizes.
std::optional<ObjectScore> ScoreObject(const std::vector<MaskedView>& views,
                                       const std::optional<int32_t>& id);

}  // namespace semfoam
