// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "foam/util/ids.h"
#include "plugin/mask/class_image.h"
#include "plugin/mask/mask_evidence.h"

#include <vector>

namespace semfoam {

// Rewrites masks by the labels of their regions. Each pixel gets the label of its region; in a
// split region, the label of the clearly nearest points, or none. Held-out photos have no regions:
// there `label_of_class` [classes of the masks] maps classes to labels, kNoLabel = unlabelled.
//
// `labels` are those that regions refer to. Labels without a region are dropped; the others keep
// their order.
class MaskRewriter {
 public:
  MaskRewriter(Evidence evidence,
               std::vector<RegionLabel> label_of_class,
               const std::vector<Label>& labels);

  const Evidence& evidence() const { return evidence_; }
  // Returns the remaining labels, one for each class of the corrected masks.
  const std::vector<Label>& labels() const { return labels_; }
  // [labels of the constructor] New class of each label, kUnlabelled if it was dropped.
  const std::vector<ClassIndex>& class_of_label() const { return class_of_label_; }

  // Returns the corrected mask of a view, empty where `image`, the original classes, is empty.
  ClassImage Rewrite(int view, const PhotoRecord& photo, const ClassImage& image) const;

 private:
  ClassIndex NewClass(RegionLabel label) const {
    return label == kNoLabel ? kUnlabelled : class_of_label_[Value(label)];
  }

  Evidence evidence_;
  // As given to the constructor.
  std::vector<RegionLabel> label_of_class_;
  std::vector<Label> labels_;
  std::vector<ClassIndex> class_of_label_;
};

}  // namespace semfoam
