// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_rewriting.h"

#include "foam/parallel.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace semfoam {
namespace {

// A pixel of a split region belongs to the label whose nearest point is less than this times as far
// as the nearest of any other label.
constexpr float kClearlyNearer = 0.7f;

// The label of every pixel of a split region, by its points: in blocks, whose size grows with the
// photo's, so that the time does not.
class SplitRegion {
 public:
  SplitRegion(const Evidence& evidence, const Region& region, const PhotoRecord& photo)
      : block_(std::max(1, std::max(photo.width, photo.height) / 160)),
        columns_((photo.width + block_ - 1) / block_),
        labels_(static_cast<size_t>(columns_) * ((photo.height + block_ - 1) / block_), kUnknown),
        evidence_(evidence),
        region_(region) {}

  int32_t LabelAt(int x, int y) {
    int32_t& label = labels_[static_cast<size_t>(y / block_) * columns_ + x / block_];
    if (label == kUnknown) {
      const auto middle = [&](int at) {
        return (static_cast<float>(at / block_) + 0.5f) * static_cast<float>(block_);
      };
      label = Nearest(middle(x), middle(y));
    }
    return label;
  }

 private:
  static constexpr int32_t kUnknown = -2;

  int32_t Nearest(float x, float y) const {
    int32_t nearest = kNoLabel;
    float distance = INFINITY, distance_of_others = INFINITY;
    for (const uint32_t i : region_.observations) {
      const Observation& observation = evidence_.observations[i];
      if (observation.label == kNoLabel) continue;
      const float d = std::hypot(observation.x - x, observation.y - y);
      if (d < distance) {
        if (observation.label != nearest) distance_of_others = distance;
        nearest = observation.label;
        distance = d;
      } else if (observation.label != nearest) {
        distance_of_others = std::min(distance_of_others, d);
      }
    }
    return distance < kClearlyNearer * distance_of_others ? nearest : kNoLabel;
  }

  int block_;
  int columns_;
  std::vector<int32_t> labels_;
  const Evidence& evidence_;
  const Region& region_;
};

}  // namespace

std::vector<int32_t> RewriteMasks(const Evidence& evidence,
                                  const std::vector<PhotoRecord>& photos,
                                  const std::vector<int32_t>& label_of_class,
                                  std::vector<Label> labels,
                                  MaskSet* masks) {
  std::vector<char> is_used(labels.size(), 0);
  for (const Region& region : evidence.regions) {
    if (region.label != kNoLabel) is_used[region.label] = 1;
    for (const int32_t part : region.parts) is_used[part] = 1;
  }
  std::vector<int32_t> class_of_label(labels.size(), kUnlabelled);
  masks->labels.clear();
  for (size_t label = 0; label < labels.size(); ++label) {
    if (!is_used[label]) continue;
    class_of_label[label] = static_cast<int32_t>(masks->labels.size());
    masks->labels.push_back(std::move(labels[label]));
  }
  const auto new_class = [&](int32_t label) {
    return label == kNoLabel ? kUnlabelled : class_of_label[label];
  };
  const auto num_classes = static_cast<int>(masks->labels.size());
  ParallelForBlocks(static_cast<int64_t>(photos.size()), 1, [&](int64_t view, int64_t) {
    if (masks->classes[view].Empty()) return;
    const PhotoRecord& photo = photos[view];
    std::vector<int32_t> class_of_class(label_of_class.size(), kUnlabelled);
    std::vector<std::unique_ptr<SplitRegion>> split(label_of_class.size());
    if (photo.held_out) {
      std::transform(
          label_of_class.begin(), label_of_class.end(), class_of_class.begin(), new_class);
    }
    auto region = std::lower_bound(
        evidence.regions.begin(), evidence.regions.end(), view, [](const Region& r, int64_t v) {
          return r.view < v;
        });
    for (; region != evidence.regions.end() && region->view == view; ++region) {
      class_of_class[region->mask_class] = new_class(region->label);
      if (!region->parts.empty()) {
        split[region->mask_class] = std::make_unique<SplitRegion>(evidence, *region, photo);
      }
    }
    ClassImage image({photo.width, photo.height}, num_classes);
    size_t pixel = 0;
    for (int y = 0; y < photo.height; ++y) {
      for (int x = 0; x < photo.width; ++x, ++pixel) {
        const int32_t c = masks->classes[view][pixel];
        if (c == kUnlabelled) continue;
        image.Set(pixel, split[c] ? new_class(split[c]->LabelAt(x, y)) : class_of_class[c]);
      }
    }
    masks->classes[view] = std::move(image);
  });
  return class_of_label;
}

}  // namespace semfoam
