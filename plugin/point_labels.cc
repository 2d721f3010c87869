// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/point_labels.h"

#include "foam/parallel.h"
#include "plugin/mask_evidence.h"

#include <algorithm>
#include <map>
#include <utility>

namespace semfoam {
namespace {

// Away from borders by so many pixels of a photo of kSafeSide pixels, a vote has its full weight.
constexpr int kSafePixels = 4;
constexpr int kSafeSide = 640;

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

  float Of(int32_t view, int32_t given_class) const {
    const auto found = weights_.find({view, given_class});
    return found == weights_.end() ? 0.5f : found->second;
  }

 private:
  std::map<std::pair<int32_t, int32_t>, float> weights_;
};

float BorderWeight(const ClassImage& image, const PhotoRecord& photo, float x, float y) {
  const int pixel = std::max(1, std::max(photo.width, photo.height) / kSafeSide);
  const int radius = UniformRadius(image, photo, x, y, kSafePixels * pixel);
  const float distance = static_cast<float>(radius) / static_cast<float>(pixel);
  return (distance + 0.5f) / (kSafePixels + 0.5f);
}

PointLabel Winner(const std::vector<Vote>& votes) {
  PointLabel label;
  float most = 0, total = 0;
  for (const Vote& vote : votes) {
    total += vote.weight;
    if (vote.weight < most || (vote.weight == most && vote.label > label.class_index)) continue;
    most = vote.weight;
    label.class_index = vote.label;
  }
  if (total > 0) label.confidence = most / total;
  return label;
}

}  // namespace

std::vector<PointLabel> LabelPoints(const MaskedPhotos& photos) {
  const Trust trust(photos.consistency);
  std::vector<PointLabel> labels(photos.sightings.size());
  constexpr int64_t kBlock = 1024;
  ParallelForBlocks(static_cast<int64_t>(labels.size()), kBlock, [&](int64_t begin, int64_t end) {
    std::vector<Vote> votes;
    for (int64_t i = begin; i < end; ++i) {
      votes.clear();
      for (const Sighting& sighting : photos.sightings[i]) {
        const PhotoRecord& photo = photos.photos[sighting.view];
        const ClassImage& image = photos.corrected.classes[sighting.view];
        const auto x = static_cast<float>(sighting.pixel.x());
        const auto y = static_cast<float>(sighting.pixel.y());
        if (image.Empty() || UniformRadius(image, photo, x, y, 0) < 0) continue;
        const size_t pixel = static_cast<size_t>(y) * photo.width + static_cast<size_t>(x);
        if (image[pixel] == kUnlabelled) continue;
        const float weight = BorderWeight(image, photo, x, y) *
                             trust.Of(sighting.view, photos.given.classes[sighting.view][pixel]);
        AddVote(image[pixel], weight, &votes);
      }
      labels[i] = Winner(votes);
    }
  });
  return labels;
}

}  // namespace semfoam
