// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/free_space.h"

#include "foam/parallel.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace semfoam {
namespace {

constexpr size_t kFewestSeeds = 50;
constexpr float kMarginOfSpread = 0.5f;
constexpr float kShortest = 0.3f, kLongest = 0.95f;  // of the nearest points' distance
constexpr size_t kNeighbors = 8;
constexpr float kFarthestNeighbor = 1.5f, kSpacing = 0.15f;  // of the clear radius
constexpr float kSameWay = 0.5f;                             // cosine

// The cone that holds the photo's corners, without a radius yet. False if the camera has no rays
// there.
bool ConeOfView(const TrainingViews& views, int view, ClearCone* cone) {
  const int right = views.Width(view) - 1, bottom = views.Height(view) - 1;
  std::vector<Eigen::Vector3f> corners;
  for (const auto& [x, y] : {std::pair(0, 0), {right, 0}, {0, bottom}, {right, bottom}}) {
    Eigen::Vector3f direction;
    if (!views.RayDirection(view, x, y, &direction)) return false;
    corners.push_back(direction);
  }
  cone->apex = views.Origin(view).cast<float>();
  cone->axis = (corners[0] + corners[1] + corners[2] + corners[3]).normalized();
  if (!cone->axis.allFinite()) return false;
  cone->cosine = 1;
  for (const Eigen::Vector3f& corner : corners) {
    cone->cosine = std::min(cone->cosine, corner.dot(cone->axis));
  }
  return true;
}

// How far the view is clear, as the header has it; 0 if too few points tell.
float ClearRadius(const ClearCone& cone, const std::vector<SeedPoint>& seeds) {
  std::vector<float> distances;
  for (const SeedPoint& seed : seeds) {
    const Eigen::Vector3f offset = seed.position - cone.apex;
    const float distance = offset.norm();
    if (offset.dot(cone.axis) > cone.cosine * distance) distances.push_back(distance);
  }
  if (distances.size() < kFewestSeeds) return 0;
  const auto quantile = [&](size_t rank) {
    std::nth_element(distances.begin(), distances.begin() + rank, distances.end());
    return distances[rank];
  };
  const float nearest = quantile(distances.size() / 50);
  const float median = quantile(distances.size() / 2);
  return std::clamp(
      nearest - kMarginOfSpread * (median - nearest), kShortest * nearest, kLongest * nearest);
}

void MeasureRadii(const std::vector<SeedPoint>& seeds, std::vector<ClearCone>* cones) {
  ParallelForBlocks(cones->size(), 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) (*cones)[i].radius = ClearRadius((*cones)[i], seeds);
  });
}

// Views between `from` and `to`; those that see too few points go out again. No wider than either,
// nor clear farther than the farther one.
std::vector<ClearCone> ConesBetween(const ClearCone& from, const ClearCone& to) {
  std::vector<ClearCone> between;
  const float spacing = kSpacing * std::min(from.radius, to.radius);
  const int steps = static_cast<int>(std::ceil((to.apex - from.apex).norm() / spacing));
  for (int step = 1; step < steps; ++step) {
    const float at = static_cast<float>(step) / static_cast<float>(steps);
    ClearCone cone;
    cone.apex = (1 - at) * from.apex + at * to.apex;
    cone.axis = ((1 - at) * from.axis + at * to.axis).normalized();
    cone.cosine = std::max(from.cosine, to.cosine);
    between.push_back(cone);
  }
  return between;
}

// The pairs of neighbours, each once, the lower index first.
std::vector<std::pair<size_t, size_t>> NeighborPairs(const std::vector<ClearCone>& cones) {
  std::vector<std::pair<size_t, size_t>> pairs;
  for (size_t i = 0; i < cones.size(); ++i) {
    std::vector<std::pair<float, size_t>> near;
    for (size_t j = 0; j < cones.size(); ++j) {
      if (j == i || cones[i].axis.dot(cones[j].axis) < kSameWay) continue;
      const float distance = (cones[j].apex - cones[i].apex).norm();
      if (distance < kFarthestNeighbor * std::min(cones[i].radius, cones[j].radius)) {
        near.emplace_back(distance, j);
      }
    }
    const size_t count = std::min(near.size(), kNeighbors);
    std::partial_sort(near.begin(), near.begin() + count, near.end());
    for (size_t k = 0; k < count; ++k) {
      pairs.push_back(std::minmax(i, near[k].second));
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

enum class Overlap { kNone, kPart, kWhole };

// Of a ball with a cone; kPart where that is not certain.
Overlap OverlapWithBall(const ClearCone& cone, const Eigen::Vector3f& center, float ball_radius) {
  const Eigen::Vector3f offset = center - cone.apex;
  const float distance = offset.norm();
  if (distance - ball_radius >= cone.radius) return Overlap::kNone;
  if (distance + ball_radius < 0.5f * cone.radius) return Overlap::kWhole;
  if (distance <= ball_radius) return Overlap::kPart;
  const float angle = std::acos(std::clamp(offset.dot(cone.axis) / distance, -1.f, 1.f));
  const float half_angle = std::acos(std::clamp(cone.cosine, -1.f, 1.f));
  // Seen from the apex, the ball spans this much to either side; a little more for rounding.
  const float span = std::asin(ball_radius / distance) + 1e-3f;
  if (angle + span < half_angle && distance + ball_radius < cone.radius) return Overlap::kWhole;
  if (angle - span > half_angle && distance - ball_radius >= 0.5f * cone.radius) {
    return Overlap::kNone;
  }
  return Overlap::kPart;
}

}  // namespace

FreeSpace::FreeSpace(const TrainingViews& views, const std::vector<SeedPoint>& seeds) {
  for (int view = 0; view < views.NumViews(); ++view) {
    ClearCone cone;
    if (!views.IsHeldOut(view) && ConeOfView(views, view, &cone)) cones_.push_back(cone);
  }
  MeasureRadii(seeds, &cones_);
  const auto says_nothing = [](const ClearCone& cone) { return !(cone.radius > 0); };
  std::erase_if(cones_, says_nothing);

  std::vector<ClearCone> between;
  std::vector<float> limits;
  for (const auto& [i, j] : NeighborPairs(cones_)) {
    const std::vector<ClearCone> of_pair = ConesBetween(cones_[i], cones_[j]);
    between.insert(between.end(), of_pair.begin(), of_pair.end());
    limits.insert(limits.end(), of_pair.size(), std::max(cones_[i].radius, cones_[j].radius));
  }
  MeasureRadii(seeds, &between);
  for (size_t k = 0; k < between.size(); ++k) {
    between[k].radius = std::min(between[k].radius, limits[k]);
  }
  std::erase_if(between, says_nothing);
  cones_.insert(cones_.end(), between.begin(), between.end());
  if (!cones_.empty()) BuildGrid();
}

void FreeSpace::BuildGrid() {
  low_ = cones_[0].apex;
  Eigen::Vector3f high = low_;
  for (const ClearCone& cone : cones_) {
    low_ = low_.cwiseMin((cone.apex.array() - cone.radius).matrix());
    high = high.cwiseMax((cone.apex.array() + cone.radius).matrix());
  }
  voxel_size_ = (high - low_).maxCoeff() / kGridSide;
  constexpr int kVoxels = kGridSide * kGridSide * kGridSide;
  is_clear_.assign(kVoxels, 0);
  std::vector<std::vector<uint32_t>> candidates(kVoxels);
  ParallelForBlocks(kVoxels, 256, [&](int64_t begin, int64_t end) {
    for (int64_t voxel = begin; voxel < end; ++voxel) {
      const int64_t x = voxel % kGridSide, y = voxel / kGridSide % kGridSide,
                    z = voxel / (kGridSide * kGridSide);
      const Eigen::Vector3f index(x, y, z);
      const Eigen::Vector3f center = low_ + voxel_size_ * (index + Eigen::Vector3f::Constant(0.5f));
      // Half a diagonal, and some for the rounding of the voxel that a point is in.
      const float ball_radius = 0.5f * std::sqrt(3.f) * voxel_size_ * 1.001f;
      for (uint32_t k = 0; k < cones_.size() && !is_clear_[voxel]; ++k) {
        const Overlap overlap = OverlapWithBall(cones_[k], center, ball_radius);
        if (overlap == Overlap::kPart) candidates[voxel].push_back(k);
        is_clear_[voxel] = overlap == Overlap::kWhole;
      }
      if (is_clear_[voxel]) candidates[voxel] = {};
    }
  });
  begins_.assign(1, 0);
  candidates_.clear();
  for (const std::vector<uint32_t>& of_voxel : candidates) {
    candidates_.insert(candidates_.end(), of_voxel.begin(), of_voxel.end());
    begins_.push_back(static_cast<uint32_t>(candidates_.size()));
  }
}

bool FreeSpace::Contains(const Eigen::Vector3f& x) const {
  if (cones_.empty()) return false;
  const Eigen::Array3f at = (x - low_).array() / voxel_size_;
  if (!(at >= 0).all() || !(at < kGridSide).all()) return false;
  const Eigen::Array3i index = at.cast<int>();
  const int voxel = (index.z() * kGridSide + index.y()) * kGridSide + index.x();
  if (is_clear_[voxel]) return true;
  return std::any_of(candidates_.begin() + begins_[voxel],
                     candidates_.begin() + begins_[voxel + 1],
                     [&](uint32_t k) { return cones_[k].Contains(x); });
}

}  // namespace semfoam
