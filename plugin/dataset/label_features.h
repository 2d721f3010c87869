// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"
#include "plugin/mask_import/region_features.h"

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace semfoam {

// Averages what is known of the regions of one object (region_features.h). A region counts as much
// as it has pixels that belong to the object, in masks that were corrected by the SfM tracks.
//
// - Class and score: each region gives its class its score, or 1 where it has none, and all others
//   0. The mean of these over the regions with a class is highest for the object's class (ties: the
//   first in alphabetical order) and is its score: a detector that is 0.9 sure of a class in half
//   of the pixels, and names another one in the rest, has a score of 0.45.
// - Without any class, the score is the mean of those regions that have one.
// - Embedding: the mean of the regions' vectors, each of unit length, made unit length again; none
//   where they cancel each other out.
class LabelFeatureMean {
 public:
  // Adds a region of which `pixels` > 0 belong to the object. `embedding` is not all 0; empty:
  // none. All that are not empty must have the same length. The sum depends on the order only by
  // its rounding.
  void Add(int64_t pixels, const RegionFeatures& region, std::span<const float> embedding);

  LabelFeatures Mean() const;

 private:
  // Sums of score times pixels by class, and of the pixels of regions with a class.
  std::map<std::string, double> score_of_class_;
  double class_pixels_ = 0;
  // The same of regions without a class.
  double score_ = 0;
  double score_pixels_ = 0;
  // Empty: no region has an embedding.
  std::vector<double> embedding_;
  double embedding_pixels_ = 0;
};

}  // namespace semfoam
