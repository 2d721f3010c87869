// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/image/image.h"
#include "foam/util/ids.h"

#include <optional>
#include <vector>

namespace semfoam {

// How well label renders agree with exact masks, by two readings of the same renders:
//   direct  the object's own id is what should be rendered;
//   prompt  the protocol of Semantic Foam's evaluation: in the object's first view, every label
//           more than half of whose pixels lie inside the mask is taken for the object; where none
//           does, the label with the most pixels inside.
// An object's score is the mean over the views in which it is seen.
struct LabelScore {
  double iou = 0;           // intersection over union, 0..1
  double recall = 0;        // share of the mask that is covered, 0..1
  double boundary_iou = 0;  // see BoundaryOf, 0..1

  // For means: adds `share` times the other's figures.
  void Add(const LabelScore& other, double share) {
    iou += share * other.iou;
    recall += share * other.recall;
    boundary_iou += share * other.boundary_iou;
  }
};

// How one view shows an object.
struct ViewLabelScore {
  size_t view = 0;  // which of the views that were added
  LabelScore prompt;
  std::optional<LabelScore> direct;
};

struct ObjectScore {
  std::vector<LabelId> prompt_labels;  // ascending
  LabelScore prompt;
  std::optional<LabelScore> direct;   // where the object's id is known
  std::vector<ViewLabelScore> views;  // those in which the mask is not empty, in order
};

// The pixels of a mask (1, else 0) that are no farther than 2 % of the image's diagonal, at least a
// pixel, from a pixel outside of it, counted along rows and columns and diagonals alike; beyond the
// image is outside. Boundary IoU (Cheng, Girshick, Dollár, Berg, Kirillov: Boundary IoU, CVPR 2021)
// is the intersection over union of the boundaries of what is rendered and of the exact mask: it
// sees ragged borders, which the IoU of a large object hides.
LabelImage BoundaryOf(const LabelImage& mask);

// Scores one object, view by view, so that no more than one of them need be in memory.
class ObjectScorer {
 public:
  // `id`: the object's own, where it is known.
  explicit ObjectScorer(std::optional<LabelId> id) : id_(id) {}

  // The next view: what was rendered and where the object truly is (non-zero). The first one with a
  // mask that is not empty is the prompt. CHECKs equal sizes.
  void Add(const LabelImage& rendered, const LabelImage& mask);

  // Nothing where no view had a mask that is not empty.
  std::optional<ObjectScore> Finish() const;

 private:
  std::optional<LabelId> id_;
  size_t num_views_ = 0;
  ObjectScore score_;
};

}  // namespace semfoam
