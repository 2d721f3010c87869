// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_suggestion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
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
class ShownScene {
 public:
  ShownScene(const std::vector<ObservedPoint>& points, size_t num_views) : shown_by_(num_views) {
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

  // Returns how much the photo adds to what is shown, in voxels; `shown` [voxels].
  double Gain(int32_t view, const std::vector<float>& shown) const {
    double gain = 0;
    for (const auto& [voxel, share] : shown_by_[view]) {
      gain += std::max(0.f, share - shown[voxel]);
    }
    return gain;
  }
  void Add(int32_t view, std::vector<float>* shown) const {
    for (const auto& [voxel, share] : shown_by_[view]) {
      (*shown)[voxel] = std::max((*shown)[voxel], share);
    }
  }

 private:
  using Share = std::pair<int32_t, float>;

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
          for (const int32_t view : views) shown_by_.at(view).emplace_back(other->second, share);
        }
      }
    }
  }

  static void KeepLargest(std::vector<Share>* shown) {
    std::sort(shown->begin(), shown->end(), [](const Share& a, const Share& b) {
      return a.first != b.first ? a.first < b.first : a.second > b.second;
    });
    shown->erase(std::unique(shown->begin(),
                             shown->end(),
                             [](const Share& a, const Share& b) { return a.first == b.first; }),
                 shown->end());
  }

  int32_t num_voxels_ = 0;
  // [views] Voxels that the photo shows, each once, and how far, 0..1.
  std::vector<std::vector<Share>> shown_by_;
};

}  // namespace

MaskSuggestion SuggestPhotosToMask(const std::vector<ObservedPoint>& points,
                                   const std::vector<bool>& has_mask,
                                   const std::vector<bool>& may_get_mask,
                                   int count) {
  CHECK_EQ(has_mask.size(), may_get_mask.size());
  const auto num_views = static_cast<int32_t>(has_mask.size());
  const ShownScene scene(points, has_mask.size());
  std::vector<float> shown(scene.NumVoxels(), 0.f);
  const auto share = [&] {
    const double sum = std::accumulate(shown.begin(), shown.end(), 0.0);
    return shown.empty() ? 0 : sum / static_cast<double>(shown.size());
  };
  std::vector<bool> is_open = may_get_mask;
  for (int32_t view = 0; view < num_views; ++view) {
    if (!has_mask[view]) continue;
    scene.Add(view, &shown);
    is_open[view] = false;
  }
  MaskSuggestion suggestion;
  suggestion.shown = share();
  while (std::ssize(suggestion.photos) < count) {
    int32_t best = -1;
    double most = 0;
    for (int32_t view = 0; view < num_views; ++view) {
      if (!is_open[view]) continue;
      const double gain = scene.Gain(view, shown);
      if (!(gain > most)) continue;
      most = gain;
      best = view;
    }
    if (best < 0) break;
    is_open[best] = false;
    scene.Add(best, &shown);
    suggestion.photos.push_back({best, share()});
  }
  return suggestion;
}

}  // namespace semfoam
