// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/views/capture_path.h"

#include "plugin/colmap/camera_rays.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <glog/logging.h>

namespace semfoam {
namespace {

// A way by name may be so much longer than one that was looked for: photos that were taken one
// after the other are in order even where they go back and forth.
constexpr double kNameIsGoodEnough = 1.5;
constexpr int kMaxPasses = 100;
constexpr double kMostTimes = 8;

class Distances {
 public:
  Distances(const std::vector<PhotoRecord>& photos, double depth)
      : photos_(photos), depth_(depth) {}
  double operator()(size_t a, size_t b) const {
    return ViewDistance(photos_[a], photos_[b], depth_);
  }

  double Length(const std::vector<size_t>& order) const {
    double length = 0;
    for (size_t k = 1; k < order.size(); ++k) length += (*this)(order[k - 1], order[k]);
    return length;
  }

 private:
  const std::vector<PhotoRecord>& photos_;
  double depth_;
};

std::vector<size_t> NearestFirst(size_t count, const Distances& distance) {
  std::vector<size_t> left(count);
  std::iota(left.begin(), left.end(), size_t{0});
  std::vector<size_t> order;
  while (!left.empty()) {
    const auto nearest = order.empty()
                             ? left.begin()
                             : std::min_element(left.begin(), left.end(), [&](size_t a, size_t b) {
                                 return distance(order.back(), a) < distance(order.back(), b);
                               });
    order.push_back(*nearest);
    left.erase(nearest);
  }
  return order;
}

// Turns pieces of the way around while that shortens it. The first photo stays the first.
void Shorten(const Distances& distance, std::vector<size_t>* order) {
  const size_t n = order->size();
  bool shorter = true;
  for (int pass = 0; shorter && pass < kMaxPasses; ++pass) {
    shorter = false;
    for (size_t i = 1; i + 1 < n; ++i) {
      for (size_t j = i + 1; j < n; ++j) {
        auto& path = *order;
        const double before =
            distance(path[i - 1], path[i]) + (j + 1 < n ? distance(path[j], path[j + 1]) : 0);
        const double after =
            distance(path[i - 1], path[j]) + (j + 1 < n ? distance(path[i], path[j + 1]) : 0);
        if (after >= before - 1e-12) continue;
        std::reverse(path.begin() + static_cast<int64_t>(i),
                     path.begin() + static_cast<int64_t>(j) + 1);
        shorter = true;
      }
    }
  }
}

Pose Between(const PhotoRecord& a, const PhotoRecord& b, double share) {
  const Pose from = PoseOf(a);
  const Pose to = PoseOf(b);
  Pose pose;
  pose.rotation = from.UnitRotation().slerp(share, to.UnitRotation()).normalized();
  const Eigen::Vector3d center = (1 - share) * from.Center() + share * to.Center();
  pose.translation = -(pose.rotation * center);
  return pose;
}

}  // namespace

double ViewDistance(const PhotoRecord& a, const PhotoRecord& b, double depth) {
  const Pose from = PoseOf(a);
  const Pose to = PoseOf(b);
  return (from.Center() - to.Center()).norm() / depth +
         from.UnitRotation().angularDistance(to.UnitRotation());
}

std::vector<size_t> CaptureOrder(const std::vector<PhotoRecord>& photos,
                                 double depth,
                                 FilmOrder order) {
  std::vector<size_t> by_name(photos.size());
  std::iota(by_name.begin(), by_name.end(), size_t{0});
  if (order == FilmOrder::kName) return by_name;
  const Distances distance(photos, depth);
  std::vector<size_t> path = NearestFirst(photos.size(), distance);
  Shorten(distance, &path);
  if (order == FilmOrder::kPath) return path;
  return distance.Length(by_name) <= kNameIsGoodEnough * distance.Length(path) ? by_name : path;
}

std::vector<FilmFrame> MakeFilm(const std::vector<PhotoRecord>& photos,
                                const std::vector<size_t>& order,
                                double depth,
                                int between) {
  std::vector<double> steps;
  for (size_t k = 1; k < order.size(); ++k) {
    steps.push_back(ViewDistance(photos[order[k - 1]], photos[order[k]], depth));
  }
  std::vector<double> sorted = steps;
  std::sort(sorted.begin(), sorted.end());
  const double median = sorted.empty() ? 0 : sorted[sorted.size() / 2];

  std::vector<FilmFrame> film;
  for (size_t k = 0; k < order.size(); ++k) {
    const PhotoRecord& photo = photos[order[k]];
    film.push_back({order[k], order[k], 0, PoseOf(photo)});
    if (k + 1 == order.size() || between == 0) continue;
    const PhotoRecord& next = photos[order[k + 1]];
    if (photo.width != next.width || photo.height != next.height) continue;
    const double times = median > 0 ? std::clamp(steps[k] / median, 0.0, kMostTimes) : 1;
    const int count = std::max(1, static_cast<int>(std::lround(between * times)));
    for (int i = 1; i <= count; ++i) {
      const double share = static_cast<double>(i) / (count + 1);
      film.push_back({order[k], order[k + 1], share, Between(photo, next, share)});
    }
  }
  return film;
}

}  // namespace semfoam
