// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_rewriting.h"

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

  RegionLabel LabelAt(int x, int y) {
    RegionLabel& label = labels_[static_cast<size_t>(y / block_) * columns_ + x / block_];
    if (label == kUnknown) {
      const auto middle = [&](int at) {
        const int block = at / block_;
        return (static_cast<float>(block) + 0.5f) * static_cast<float>(block_);
      };
      label = Nearest(middle(x), middle(y));
    }
    return label;
  }

 private:
  static constexpr RegionLabel kUnknown{-2};

  RegionLabel Nearest(float x, float y) const {
    RegionLabel nearest = kNoLabel;
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
  std::vector<RegionLabel> labels_;
  const Evidence& evidence_;
  const Region& region_;
};

}  // namespace

MaskRewriter::MaskRewriter(Evidence evidence,
                           std::vector<RegionLabel> label_of_class,
                           const std::vector<Label>& labels)
    : evidence_(std::move(evidence)),
      label_of_class_(std::move(label_of_class)),
      class_of_label_(labels.size(), kUnlabelled) {
  std::vector<char> is_used(labels.size(), 0);
  for (const Region& region : evidence_.regions) {
    if (region.label != kNoLabel) is_used[Value(region.label)] = 1;
    for (const RegionLabel part : region.parts) is_used[Value(part)] = 1;
  }
  for (size_t label = 0; label < labels.size(); ++label) {
    if (!is_used[label]) continue;
    class_of_label_[label] = static_cast<ClassIndex>(labels_.size());
    labels_.push_back(labels[label]);
  }
}

ClassImage MaskRewriter::Rewrite(int view,
                                 const PhotoRecord& photo,
                                 const ClassImage& image) const {
  if (image.Empty()) return {};
  std::vector<ClassIndex> class_of_class(label_of_class_.size(), kUnlabelled);
  std::vector<std::unique_ptr<SplitRegion>> split(label_of_class_.size());
  if (photo.held_out) {
    std::transform(label_of_class_.begin(),
                   label_of_class_.end(),
                   class_of_class.begin(),
                   [&](RegionLabel label) { return NewClass(label); });
  }
  auto region = std::lower_bound(
      evidence_.regions.begin(), evidence_.regions.end(), view, [](const Region& r, int v) {
        return r.view < v;
      });
  for (; region != evidence_.regions.end() && region->view == view; ++region) {
    class_of_class[Value(region->mask_class)] = NewClass(region->label);
    if (!region->parts.empty()) {
      split[Value(region->mask_class)] = std::make_unique<SplitRegion>(evidence_, *region, photo);
    }
  }
  ClassImage rewritten({photo.width, photo.height}, static_cast<int>(labels_.size()));
  size_t pixel = 0;
  for (int y = 0; y < photo.height; ++y) {
    for (int x = 0; x < photo.width; ++x, ++pixel) {
      if (image[pixel] == kUnlabelled) continue;
      const int32_t c = Value(image[pixel]);
      rewritten.Set(pixel, split[c] ? NewClass(split[c]->LabelAt(x, y)) : class_of_class[c]);
    }
  }
  return rewritten;
}

}  // namespace semfoam
