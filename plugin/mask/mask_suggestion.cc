// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_suggestion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Voxels along the longest side of the scene's box.
constexpr double kVoxelsAlong = 20;
// The scene's box is that of all points but this share at either end of each axis, and a margin of
// this share of its longest side: points that are far off are mostly wrong.
constexpr double kTailShare = 0.02, kMargin = 0.3;
// Distance in voxels at which a photo shows nothing of a voxel, beside one that it shows.
constexpr int kReach = 4;

using Voxel = std::array<int32_t, 3>;

// A box, closed.
struct Box {
  Eigen::Vector3d least = Eigen::Vector3d::Zero(), most = Eigen::Vector3d::Zero();
};

Box BoxOf(const std::vector<ObservedPoint>& points) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    values.reserve(points.size());
    for (const ObservedPoint& point : points) values.push_back(point.position[axis]);
    std::sort(values.begin(), values.end());
    const auto tail = static_cast<size_t>(kTailShare * static_cast<double>(values.size() - 1));
    box.least[axis] = values[tail];
    box.most[axis] = values[values.size() - 1 - tail];
  }
  return box;
}

// The voxels of the scene, and how far each photo shows them.
class ShownVoxels {
 public:
  ShownVoxels(const std::vector<ObservedPoint>& points, size_t num_views) : shown_by_(num_views) {
    if (points.empty()) return;
    Box box = BoxOf(points);
    const double side = (box.most - box.least).maxCoeff();
    const double voxel = side > 0 ? side / kVoxelsAlong : 1;
    box.least.array() -= kMargin * side;
    box.most.array() += kMargin * side;
    std::map<Voxel, std::vector<int32_t>> views_of;
    for (const ObservedPoint& point : points) {
      if ((point.position.array() < box.least.array()).any() ||
          (point.position.array() > box.most.array()).any()) {
        continue;
      }
      const Eigen::Vector3d place = ((point.position - box.least) / voxel).array().floor();
      std::vector<int32_t>& views = views_of[{static_cast<int32_t>(place.x()),
                                              static_cast<int32_t>(place.y()),
                                              static_cast<int32_t>(place.z())}];
      views.insert(views.end(), point.views.begin(), point.views.end());
    }
    std::map<Voxel, int32_t> index;
    for (const auto& [where, views] : views_of) index.emplace(where, num_voxels_++);
    for (const auto& [where, views] : views_of) Show(where, views, index);
    for (auto& shown : shown_by_) KeepLargest(&shown);
  }

  int32_t NumVoxels() const { return num_voxels_; }
  // [views] Voxels that the photo shows, each once.
  const std::vector<std::vector<ShownPart>>& ShownBy() const { return shown_by_; }

 private:
  // Adds a voxel and those around it to what these photos show.
  void Show(const Voxel& where,
            const std::vector<int32_t>& views,
            const std::map<Voxel, int32_t>& index) {
    for (int dz = 1 - kReach; dz < kReach; ++dz) {
      for (int dy = 1 - kReach; dy < kReach; ++dy) {
        for (int dx = 1 - kReach; dx < kReach; ++dx) {
          const float share = 1 - std::sqrt(float(dx * dx + dy * dy + dz * dz)) / kReach;
          const auto other = index.find({where[0] + dx, where[1] + dy, where[2] + dz});
          if (other == index.end()) continue;
          for (const int32_t view : views) shown_by_.at(view).push_back({other->second, share});
        }
      }
    }
  }

  static void KeepLargest(std::vector<ShownPart>* shown) {
    std::sort(shown->begin(), shown->end(), [](const ShownPart& a, const ShownPart& b) {
      return a.part != b.part ? a.part < b.part : a.share > b.share;
    });
    shown->erase(
        std::unique(shown->begin(),
                    shown->end(),
                    [](const ShownPart& a, const ShownPart& b) { return a.part == b.part; }),
        shown->end());
  }

  int32_t num_voxels_ = 0;
  std::vector<std::vector<ShownPart>> shown_by_;
};

// How much of each part of a scene is shown.
class ShownScene {
 public:
  ShownScene(const std::vector<float>& weight, const std::vector<std::vector<ShownPart>>& shown_by)
      : weight_(weight), shown_by_(shown_by), shown_(weight.size(), 0.f) {
    for (const float part : weight) total_ += part;
  }

  // Returns how much the photo would add.
  double Gain(int32_t view) const {
    double gain = 0;
    for (const ShownPart& part : shown_by_[view]) {
      gain += weight_[part.part] * std::max(0.f, part.share - shown_[part.part]);
    }
    return gain;
  }
  void Add(int32_t view) {
    for (const ShownPart& part : shown_by_[view]) {
      shown_[part.part] = std::max(shown_[part.part], part.share);
    }
  }
  // Returns the share of the scene that is shown.
  double Share() const {
    double sum = 0;
    for (size_t i = 0; i < shown_.size(); ++i) sum += double{weight_[i]} * shown_[i];
    return total_ > 0 ? sum / total_ : 0;
  }

 private:
  const std::vector<float>& weight_;
  const std::vector<std::vector<ShownPart>>& shown_by_;
  double total_ = 0;
  // [parts] 0..1
  std::vector<float> shown_;
};

}  // namespace

MaskSuggestion SuggestPhotosToMask(const std::vector<ObservedPoint>& points,
                                   const std::vector<bool>& has_mask,
                                   const std::vector<bool>& may_get_mask,
                                   int count) {
  const ShownVoxels voxels(points, has_mask.size());
  const std::vector<float> weight(voxels.NumVoxels(), 1.f);
  return SuggestPhotosToMask(weight, voxels.ShownBy(), has_mask, may_get_mask, count);
}

MaskSuggestion SuggestPhotosToMask(const std::vector<float>& weight,
                                   const std::vector<std::vector<ShownPart>>& shown_by,
                                   const std::vector<bool>& has_mask,
                                   const std::vector<bool>& may_get_mask,
                                   int count) {
  CHECK_EQ(has_mask.size(), may_get_mask.size());
  CHECK_EQ(has_mask.size(), shown_by.size());
  const auto num_views = static_cast<int32_t>(has_mask.size());
  ShownScene scene(weight, shown_by);
  std::vector<bool> is_open = may_get_mask;
  for (int32_t view = 0; view < num_views; ++view) {
    if (!has_mask[view]) continue;
    scene.Add(view);
    is_open[view] = false;
  }
  MaskSuggestion suggestion;
  suggestion.shown = scene.Share();
  while (std::ssize(suggestion.photos) < count) {
    int32_t best = -1;
    double most = 0;
    for (int32_t view = 0; view < num_views; ++view) {
      if (!is_open[view]) continue;
      const double gain = scene.Gain(view);
      if (!(gain > most)) continue;
      most = gain;
      best = view;
    }
    if (best < 0) break;
    is_open[best] = false;
    scene.Add(best);
    suggestion.photos.push_back({best, scene.Share()});
  }
  return suggestion;
}

}  // namespace semfoam
