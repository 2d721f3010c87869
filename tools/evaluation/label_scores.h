// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"
#include "foam/util/ids.h"

#include <optional>
#include <vector>

namespace semfoam {

// Compares label renders with exact masks, by two kinds of scores of the same renders:
//   direct  the object's own id is what should be rendered;
//   prompt  the protocol of Semantic Foam's evaluation: in the object's first view, every label
//           more than half of whose pixels lie inside the mask is taken for the object; where none
//           does, the label with the most pixels inside.
// An object's score is the mean over the views in which it is seen.
struct LabelScore {
  // Intersection over union, 0..1.
  double iou = 0;
  // Share of the mask that is covered, 0..1.
  double recall = 0;
  // IoU of the boundaries (BoundaryOf), 0..1.
  double boundary_iou = 0;

  // Adds `share` times the other's figures, for means.
  void Add(const LabelScore& other, double share) {
    iou += share * other.iou;
    recall += share * other.recall;
    boundary_iou += share * other.boundary_iou;
  }
};

// Score of an object in one view.
struct ViewLabelScore {
  // Index of the view in the order of Add.
  size_t view = 0;
  LabelScore prompt;
  std::optional<LabelScore> direct;
};

struct ObjectScore {
  // Ascending.
  std::vector<LabelId> prompt_labels;
  LabelScore prompt;
  // Set if the object's id is known.
  std::optional<LabelScore> direct;
  // The views in which the mask is not empty, in order.
  std::vector<ViewLabelScore> views;
};

// Returns the boundary pixels of a mask (1, else 0): those that are no farther than 2 % of the
// image's diagonal, at least a pixel, from a pixel outside of it, counted along rows, columns and
// diagonals; outside of the image is outside of the mask. Boundary IoU (Cheng, Girshick, Dollár,
// Berg, Kirillov: Boundary IoU, CVPR 2021) is the intersection over union of the boundaries of the
// rendered and of the exact mask: it is sensitive to ragged borders, which the IoU of a large
// object is not.
LabelImage BoundaryOf(const LabelImage& mask);

// Scores one object, view by view, so that only one view has to be in memory.
class ObjectScorer {
 public:
  // `id` is the object's own, if it is known.
  explicit ObjectScorer(std::optional<LabelId> id) : id_(id) {}

  // Adds the next view: the rendered labels and the exact mask (non-zero for the object). The first
  // view with a mask that is not empty is the prompt. CHECKs equal sizes.
  void Add(const LabelImage& rendered, const LabelImage& mask);

  // Returns the score; nothing if all masks were empty.
  std::optional<ObjectScore> Finish() const;

 private:
  std::optional<LabelId> id_;
  size_t num_views_ = 0;
  ObjectScore score_;
};

}  // namespace semfoam
