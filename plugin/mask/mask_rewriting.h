// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/mask/mask_evidence.h"
#include "plugin/mask/masks.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Writes into masks what their regions were found to be: each pixel gets its region's label; of
// a split region, that of the points clearly nearest to it, or none. Held-out photos have no
// regions; `label_of_class` [classes of the masks] is for them, kNoLabel = unlabelled.
//
// `labels` are all that regions refer to. Those that no region has are left out; the order of the
// others remains.
class MaskRewriter {
 public:
  MaskRewriter(Evidence evidence,
               std::vector<int32_t> label_of_class,
               const std::vector<Label>& labels);

  const Evidence& evidence() const { return evidence_; }
  const std::vector<Label>& labels() const { return labels_; }  // that are left
  // The class that each label has become, kUnlabelled where it is left out.
  const std::vector<int32_t>& class_of_label() const { return class_of_label_; }

  // The view's mask, whose classes are those of the masks as they were. An empty one stays empty.
  ClassImage Rewrite(int view, const PhotoRecord& photo, const ClassImage& image) const;

 private:
  int32_t NewClass(int32_t label) const {
    return label == kNoLabel ? kUnlabelled : class_of_label_[label];
  }

  Evidence evidence_;
  std::vector<int32_t> label_of_class_;
  std::vector<Label> labels_;
  std::vector<int32_t> class_of_label_;
};

}  // namespace semfoam
