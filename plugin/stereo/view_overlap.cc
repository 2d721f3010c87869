// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/view_overlap.h"

#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <utility>

namespace semfoam {
namespace {

constexpr size_t kFewestPoints = 10;
// Below this number of points with tracks, those without count, too.
constexpr size_t kEnoughTracks = 30;
// Points that are looked at in a view; of more, an even sample.
constexpr size_t kMostPoints = 300;
constexpr double kBestAngle = 10 * 3.14159265358979 / 180;
constexpr double kWithoutTrack = 0.25;
constexpr double kMargin = 1.5;

// A point that a view sees.
struct SeenPoint {
  Eigen::Vector3d position;
  double depth = 0;
  // Null: a seed, whose track is not known.
  const Track* track = nullptr;
};

// 1 at kBestAngle, falling as the angle below it and as its inverse square above.
double AngleWeight(double angle) {
  const double ratio = angle / kBestAngle;
  return ratio < 1 ? ratio : 1 / (ratio * ratio);
}

template <typename T>
std::vector<T> EvenSample(const std::vector<T>& all, size_t most) {
  if (all.size() <= most) return all;
  std::vector<T> sample;
  for (size_t i = 0; i < most; ++i) sample.push_back(all[i * all.size() / most]);
  return sample;
}

bool HasView(const Track& track, int view) {
  return std::any_of(track.observations.begin(), track.observations.end(), [&](const auto& seen) {
    return seen.view == view;
  });
}

std::vector<SeenPoint> PointsOf(const StereoView& view,
                                const std::vector<const Track*>& tracks,
                                const std::vector<SeedPoint>& seeds) {
  std::vector<SeenPoint> points;
  Eigen::Vector2d pixel;
  const auto add = [&](const Eigen::Vector3d& position, const Track* track) {
    SeenPoint point{position, 0, track};
    if (view.Project(position, &pixel, &point.depth) && view.Contains(pixel)) {
      points.push_back(point);
    }
  };
  for (const Track* track : tracks) add(track->position, track);
  if (points.size() < kEnoughTracks) {
    for (const SeedPoint& seed : seeds) add(seed.position.cast<double>(), nullptr);
  }
  return points;
}

InverseDepths DepthsOf(const std::vector<SeenPoint>& points) {
  std::vector<double> depths;
  depths.reserve(points.size());
  for (const SeenPoint& point : points) depths.push_back(point.depth);
  std::sort(depths.begin(), depths.end());
  const size_t skip = depths.size() / 50;
  return {1 / (kMargin * depths[depths.size() - 1 - skip]), kMargin / depths[skip]};
}

double ScoreOf(const StereoView& view,
               const StereoView& other,
               const std::vector<SeenPoint>& points) {
  double score = 0;
  Eigen::Vector2d pixel;
  double depth = 0;
  for (const SeenPoint& point : points) {
    if (!other.Project(point.position, &pixel, &depth) || !other.Contains(pixel)) continue;
    const Eigen::Vector3d a = view.origin - point.position, b = other.origin - point.position;
    const double angle = std::atan2(a.cross(b).norm(), a.dot(b));
    const double ratio = view.focal.x() * b.norm() / (other.focal.x() * a.norm());
    const bool is_matched = point.track != nullptr && HasView(*point.track, other.view);
    score += AngleWeight(angle) * std::min(ratio, 1 / ratio) * (is_matched ? 1 : kWithoutTrack);
  }
  return score;
}

}  // namespace

std::vector<ViewOverlap> FindOverlaps(const std::vector<StereoView>& views,
                                      const std::vector<Track>& tracks,
                                      const std::vector<SeedPoint>& seeds) {
  std::unordered_map<int32_t, size_t> index_of;
  for (size_t i = 0; i < views.size(); ++i) index_of[views[i].view] = i;
  std::vector<std::vector<const Track*>> tracks_of(views.size());
  for (const Track& track : tracks) {
    for (const PixelObservation& seen : track.observations) {
      const auto index = index_of.find(seen.view);
      if (index != index_of.end()) tracks_of[index->second].push_back(&track);
    }
  }
  std::vector<ViewOverlap> overlaps(views.size());
  ParallelForBlocks(static_cast<int64_t>(views.size()), 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const std::vector<SeenPoint> points = PointsOf(views[i], tracks_of[i], seeds);
      if (points.size() < kFewestPoints) continue;
      overlaps[i].depths = DepthsOf(points);
      const std::vector<SeenPoint> sample = EvenSample(points, kMostPoints);
      std::vector<std::pair<double, int>> scores;
      for (size_t j = 0; j < views.size(); ++j) {
        if (static_cast<int64_t>(j) == i) continue;
        const double score = ScoreOf(views[i], views[j], sample);
        if (score > 0) scores.emplace_back(-score, static_cast<int>(j));
      }
      std::sort(scores.begin(), scores.end());
      scores.resize(std::min(scores.size(), kMostPartners));
      for (const auto& [score, j] : scores) overlaps[i].partners.push_back(j);
    }
  });
  return overlaps;
}

}  // namespace semfoam
