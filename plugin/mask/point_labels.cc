// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/point_labels.h"

#include "foam/util/parallel.h"
#include "plugin/mask/mask_evidence.h"

#include <algorithm>
#include <map>
#include <utility>

namespace semfoam {
namespace {

// How far each region is to be trusted, by view and class of the masks as given. Without a report,
// all are trusted alike.
class Trust {
 public:
  explicit Trust(const MaskConsistencyReport& report) {
    for (const RegionReport& region : report.regions) {
      weights_[{region.view, region.given_class}] =
          (region.num_agreeing + 1.f) / (static_cast<float>(region.num_judged) + 2.f);
    }
  }

  float Of(int32_t view, ClassIndex given_class) const {
    const auto found = weights_.find({view, given_class});
    return found == weights_.end() ? 0.5f : found->second;
  }

 private:
  std::map<std::pair<int32_t, ClassIndex>, float> weights_;
};

PointLabel Winner(const std::vector<Vote<ClassIndex>>& votes) {
  PointLabel label;
  float most = 0, total = 0;
  for (const Vote<ClassIndex>& vote : votes) {
    total += vote.weight;
    if (vote.weight < most || (vote.weight == most && vote.label > label.class_index)) continue;
    most = vote.weight;
    label.class_index = vote.label;
  }
  if (total > 0) label.confidence = most / total;
  return label;
}

}  // namespace

float BorderWeight(int radius, const PhotoRecord& photo) {
  const int pixel = SafeRadius(photo) / kSafePixels;
  const float distance = static_cast<float>(radius) / static_cast<float>(pixel);
  return (distance + 0.5f) / (kSafePixels + 0.5f);
}

std::vector<PointLabel> LabelPoints(const MaskedPhotos& photos) {
  const Trust trust(photos.consistency);
  std::vector<PointLabel> labels(photos.observations.size());
  constexpr int64_t kBlock = 1024;
  ParallelForBlocks(static_cast<int64_t>(labels.size()), kBlock, [&](int64_t begin, int64_t end) {
    std::vector<Vote<ClassIndex>> votes;
    for (int64_t i = begin; i < end; ++i) {
      votes.clear();
      for (size_t k = 0; k < photos.observations[i].size(); ++k) {
        const int32_t view = photos.observations[i][k].view;
        const MaskObservation& shown = photos.shown[i][k];
        if (shown.corrected_class == kUnlabelled) continue;
        const float weight = BorderWeight(shown.corrected_radius, photos.photos[view]) *
                             trust.Of(view, shown.given_class);
        AddVote(shown.corrected_class, weight, &votes);
      }
      labels[i] = Winner(votes);
    }
  });
  return labels;
}

}  // namespace semfoam
