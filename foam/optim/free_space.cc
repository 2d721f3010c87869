// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/optim/free_space.h"

#include "foam/geometry/guard_sites.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>

namespace semfoam {
namespace {

constexpr size_t kFewestSeeds = 50;
constexpr float kMarginOfSpread = 0.5f;
constexpr float kShortest = 0.3f, kLongest = 0.95f;  // of the nearest points' distance
constexpr size_t kNeighbors = 8;
constexpr float kFarthestNeighbor = 1.5f, kSpacing = 0.15f;  // of the clear radius
constexpr float kSameWay = 0.5f;                             // cosine

// Computes the cone that contains the photo's corners, without a radius. Returns false if the
// camera has no rays there.
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

// Returns the coordinate as 21 bits, 0 and 1 being the ends of their range, each followed by two
// zeros.
uint64_t SpreadBits(float coordinate) {
  constexpr uint64_t kLargest = (uint64_t{1} << 21) - 1;
  uint64_t bits = std::min(kLargest, static_cast<uint64_t>(coordinate * float{kLargest}));
  bits = (bits | bits << 32) & 0x1f00000000ffff;
  bits = (bits | bits << 16) & 0x1f0000ff0000ff;
  bits = (bits | bits << 8) & 0x100f00f00f00f00f;
  bits = (bits | bits << 4) & 0x10c30c30c30c30c3;
  return (bits | bits << 2) & 0x1249249249249249;
}

// Seeds in Morton order, in blocks with a ball around each, so that those in and around a cone are
// found without looking at every seed.
class SeedBlocks {
 public:
  explicit SeedBlocks(const std::vector<SeedPoint>& seeds) {
    if (seeds.empty()) return;
    Eigen::AlignedBox3f box(seeds[0].position);
    for (const SeedPoint& seed : seeds) box.extend(seed.position);
    const float side = std::max(box.sizes().maxCoeff(), std::numeric_limits<float>::min());
    std::vector<std::pair<uint64_t, uint32_t>> order;
    order.reserve(seeds.size());
    for (uint32_t i = 0; i < seeds.size(); ++i) {
      const Eigen::Vector3f at = (seeds[i].position - box.min()) / side;
      order.emplace_back(SpreadBits(at.x()) | SpreadBits(at.y()) << 1 | SpreadBits(at.z()) << 2, i);
    }
    std::sort(order.begin(), order.end());
    positions_.reserve(seeds.size());
    for (const auto& [code, i] : order) positions_.push_back(seeds[i].position);
    const size_t size = std::max(kSmallestBlock, (seeds.size() + kMostBlocks - 1) / kMostBlocks);
    for (size_t begin = 0; begin < positions_.size(); begin += size) {
      AddBlock(begin, std::min(begin + size, positions_.size()));
    }
  }

  // Computes the distances from the apex to the seeds in the cone, ignoring its radius; if the
  // blocks that touch it have more than `most` seeds, of an even sample, each of which represents
  // `*weight` seeds. Returns how many seeds and blocks were tested.
  int64_t DistancesIn(const ClearCone& cone,
                      int64_t most,
                      std::vector<float>* distances,
                      size_t* weight) const {
    std::vector<const Block*> touched;
    size_t num_seeds = 0;
    const float sine = std::sqrt(std::max(0.f, 1 - cone.cosine * cone.cosine));
    for (const Block& block : blocks_) {
      const Eigen::Vector3f offset = block.center - cone.apex;
      const float along = offset.dot(cone.axis);
      const float across = (offset - along * cone.axis).norm();
      // The distance from the cone's surface, or less than that where the apex is nearest.
      if (across * cone.cosine - along * sine > block.radius + 1e-5f * offset.norm()) continue;
      touched.push_back(&block);
      num_seeds += block.end - block.begin;
    }
    *weight = std::max<size_t>(1, (num_seeds + most - 1) / most);
    distances->clear();
    size_t skip = 0;  // seeds of this block before the next one of the sample
    for (const Block* block : touched) {
      size_t i = block->begin + skip;
      for (; i < block->end; i += *weight) {
        const Eigen::Vector3f offset = positions_[i] - cone.apex;
        const float distance = offset.norm();
        if (offset.dot(cone.axis) > cone.cosine * distance) distances->push_back(distance);
      }
      skip = i - block->end;
    }
    return static_cast<int64_t>(blocks_.size() + num_seeds / *weight);
  }

 private:
  struct Block {
    size_t begin, end;
    Eigen::Vector3f center;
    float radius;
  };

  void AddBlock(size_t begin, size_t end) {
    Eigen::AlignedBox3f box(positions_[begin]);
    for (size_t i = begin; i < end; ++i) box.extend(positions_[i]);
    // The 1e-5 are for rounding.
    blocks_.push_back({begin, end, box.center(), 0.50001f * box.diagonal().norm()});
  }

  static constexpr size_t kSmallestBlock = 64, kMostBlocks = 4096;

  std::vector<Eigen::Vector3f> positions_;
  std::vector<Block> blocks_;
};

// Returns how far a view is clear (FreeSpace), from the distances of the seeds in it, each of which
// represents `weight` seeds; 0 if there are too few.
float ClearRadius(std::vector<float>* distances, size_t weight) {
  if (distances->empty() || distances->size() * weight < kFewestSeeds) return 0;
  const auto quantile = [&](size_t rank) {
    std::nth_element(distances->begin(), distances->begin() + rank, distances->end());
    return (*distances)[rank];
  };
  const float nearest = quantile(distances->size() / 50);
  const float median = quantile(distances->size() / 2);
  return std::clamp(
      nearest - kMarginOfSpread * (median - nearest), kShortest * nearest, kLongest * nearest);
}

// Measures the radii of the cones. Returns how many seeds and blocks of them were tested.
int64_t MeasureRadii(const SeedBlocks& seeds, std::vector<ClearCone>* cones) {
  if (cones->empty()) return 0;
  const int64_t most = std::max(FreeSpace::kFewestSampledSeeds,
                                FreeSpace::kMostSeedTests / static_cast<int64_t>(cones->size()));
  std::vector<int64_t> tests(cones->size());
  ParallelForBlocks(cones->size(), 16, [&](int64_t begin, int64_t end) {
    std::vector<float> distances;
    for (int64_t i = begin; i < end; ++i) {
      size_t weight = 1;
      tests[i] = seeds.DistancesIn((*cones)[i], most, &distances, &weight);
      (*cones)[i].radius = ClearRadius(&distances, weight);
    }
  });
  return std::accumulate(tests.begin(), tests.end(), int64_t{0});
}

// Returns the number of parts into which the interpolated views divide the way from one to the
// other.
int StepsBetween(const ClearCone& from, const ClearCone& to, float spacing) {
  const float step = spacing * std::min(from.radius, to.radius);
  return static_cast<int>(std::ceil((to.apex - from.apex).norm() / step));
}

// Returns interpolated views between `from` and `to`, no wider than either. The caller measures
// their radii, limits them to the larger one of the two, and removes views with too few points.
std::vector<ClearCone> ConesBetween(const ClearCone& from, const ClearCone& to, int steps) {
  std::vector<ClearCone> between;
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

// Returns the pairs of neighbours, each once, the lower index first.
std::vector<std::pair<size_t, size_t>> NeighborPairs(const std::vector<ClearCone>& cones) {
  std::vector<std::vector<size_t>> neighbors(cones.size());
  ParallelForBlocks(cones.size(), 16, [&](int64_t begin, int64_t end) {
    std::vector<std::pair<float, size_t>> near;
    for (int64_t i = begin; i < end; ++i) {
      near.clear();
      for (size_t j = 0; j < cones.size(); ++j) {
        if (j == static_cast<size_t>(i) || cones[i].axis.dot(cones[j].axis) < kSameWay) continue;
        const float distance = (cones[j].apex - cones[i].apex).norm();
        if (distance < kFarthestNeighbor * std::min(cones[i].radius, cones[j].radius)) {
          near.emplace_back(distance, j);
        }
      }
      const size_t count = std::min(near.size(), kNeighbors);
      std::partial_sort(near.begin(), near.begin() + count, near.end());
      for (size_t k = 0; k < count; ++k) neighbors[i].push_back(near[k].second);
    }
  });
  std::vector<std::pair<size_t, size_t>> pairs;
  for (size_t i = 0; i < cones.size(); ++i) {
    for (const size_t j : neighbors[i]) pairs.push_back(std::minmax(i, j));
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

// Returns the spacing of interpolated views, in clear radii: kSpacing, or more where there would be
// too many.
float SpacingOf(const std::vector<ClearCone>& cones,
                const std::vector<std::pair<size_t, size_t>>& pairs) {
  for (float spacing = kSpacing;; spacing *= 1.25f) {
    int64_t between = 0;
    for (const auto& [i, j] : pairs) between += StepsBetween(cones[i], cones[j], spacing) - 1;
    if (between <= FreeSpace::kMostConesBetween) return spacing;
  }
}

enum class Overlap { kNone, kPart, kWhole };

// Returns the overlap of a ball with a cone; kPart where that is not certain.
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

// Returns FreeSpace::sky_begin for seeds without those of sky.
float SkyBegin(const TrainingViews& views, const std::vector<SeedPoint>& seeds) {
  constexpr double kShare = 0.99;
  constexpr float kMargin = 1.2f;
  // Plain ground around a thing may have no seed at all.
  constexpr float kCameraMargin = 3;
  float farthest_camera = 0;
  for (int view = 0; view < views.NumViews(); ++view) {
    if (views.IsHeldOut(view)) continue;
    farthest_camera = std::max(farthest_camera, static_cast<float>(views.Origin(view).norm()));
  }
  const float least = kCameraMargin * farthest_camera;
  std::vector<float> distances;
  distances.reserve(seeds.size());
  for (const SeedPoint& seed : seeds) distances.push_back(seed.position.norm());
  if (distances.empty()) return least;
  const auto at = distances.begin() +
                  static_cast<ptrdiff_t>(kShare * static_cast<double>(distances.size() - 1));
  std::nth_element(distances.begin(), at, distances.end());
  return std::max(least, kMargin * *at);
}

}  // namespace

FreeSpace::FreeSpace(const TrainingViews& views, const std::vector<SeedPoint>& seeds)
    : ground_(views.Ground()) {
  for (int view = 0; view < views.NumViews(); ++view) {
    ClearCone cone;
    if (!views.IsHeldOut(view) && ConeOfView(views, view, &cone)) cones_.push_back(cone);
  }
  std::vector<SeedPoint> surfaces;
  std::copy_if(seeds.begin(), seeds.end(), std::back_inserter(surfaces), [](const SeedPoint& seed) {
    return !IsSkySite(seed.position);
  });
  if (surfaces.size() < seeds.size()) sky_begin_ = SkyBegin(views, surfaces);
  const SeedBlocks blocks(surfaces);
  num_seed_tests_ = MeasureRadii(blocks, &cones_);
  const auto says_nothing = [](const ClearCone& cone) { return !(cone.radius > 0); };
  std::erase_if(cones_, says_nothing);

  std::vector<ClearCone> between;
  std::vector<float> limits;
  const std::vector<std::pair<size_t, size_t>> pairs = NeighborPairs(cones_);
  const float spacing = SpacingOf(cones_, pairs);
  for (const auto& [i, j] : pairs) {
    const std::vector<ClearCone> of_pair =
        ConesBetween(cones_[i], cones_[j], StepsBetween(cones_[i], cones_[j], spacing));
    between.insert(between.end(), of_pair.begin(), of_pair.end());
    limits.insert(limits.end(), of_pair.size(), std::max(cones_[i].radius, cones_[j].radius));
  }
  num_seed_tests_ += MeasureRadii(blocks, &between);
  for (size_t k = 0; k < between.size(); ++k) {
    between[k].radius = std::min(between[k].radius, limits[k]);
  }
  std::erase_if(between, says_nothing);
  cones_.insert(cones_.end(), between.begin(), between.end());
  if (!cones_.empty()) BuildGrid();
}

void FreeSpace::BuildGrid() {
  Eigen::AlignedBox3f box(cones_[0].apex);
  for (const ClearCone& cone : cones_) {
    box.extend((cone.apex.array() - cone.radius).matrix());
    box.extend((cone.apex.array() + cone.radius).matrix());
  }
  low_ = box.min();
  voxel_size_ = box.sizes().maxCoeff() / kGridSide;
  std::vector<VoxelRange> near;
  near.reserve(cones_.size());
  for (const ClearCone& cone : cones_) near.push_back(VoxelsNear(cone));
  constexpr int kRows = kGridSide * kGridSide;
  is_clear_.assign(kRows * kGridSide, 0);
  std::vector<std::vector<uint32_t>> candidates(kRows * kGridSide);
  ParallelForBlocks(kRows, 4, [&](int64_t begin, int64_t end) {
    for (auto row = static_cast<int>(begin); row < end; ++row) {
      BuildRow(row % kGridSide, row / kGridSide, near, &candidates[row * kGridSide]);
    }
  });
  begins_.assign(1, 0);
  candidates_.clear();
  for (const std::vector<uint32_t>& of_voxel : candidates) {
    candidates_.insert(candidates_.end(), of_voxel.begin(), of_voxel.end());
    begins_.push_back(static_cast<uint32_t>(candidates_.size()));
  }
}

FreeSpace::VoxelRange FreeSpace::VoxelsNear(const ClearCone& cone) const {
  const Eigen::Array3f apex = cone.apex - low_;
  return {(((apex - cone.radius) / voxel_size_).floor().cast<int>() - 1).max(0),
          (((apex + cone.radius) / voxel_size_).floor().cast<int>() + 1).min(kGridSide - 1)};
}

void FreeSpace::BuildRow(int y,
                         int z,
                         const std::vector<VoxelRange>& near,
                         std::vector<uint32_t>* candidates) {
  uint8_t* const is_clear = &is_clear_[(z * kGridSide + y) * kGridSide];
  std::vector<uint32_t> touching[kGridSide];
  for (uint32_t k = 0; k < cones_.size(); ++k) {
    const VoxelRange& range = near[k];
    if (y < range.low.y() || y > range.high.y() || z < range.low.z() || z > range.high.z()) {
      continue;
    }
    for (int x = range.low.x(); x <= range.high.x(); ++x) {
      if (is_clear[x]) continue;
      const Eigen::Vector3f center = low_ + voxel_size_ * (Eigen::Array3f(x, y, z) + 0.5f).matrix();
      // Half a diagonal, and some for the rounding of the voxel that a point is in.
      const float ball_radius = 0.5f * std::sqrt(3.f) * voxel_size_ * 1.001f;
      const Overlap overlap = OverlapWithBall(cones_[k], center, ball_radius);
      if (overlap == Overlap::kPart) touching[x].push_back(k);
      is_clear[x] = overlap == Overlap::kWhole;
    }
  }
  for (int x = 0; x < kGridSide; ++x) {
    if (is_clear[x]) continue;
    const std::vector<uint32_t>& all = touching[x];
    const size_t count = std::min(all.size(), kMostCandidates);
    candidates[x].reserve(count);
    for (size_t i = 0; i < count; ++i) candidates[x].push_back(all[i * all.size() / count]);
  }
}

bool FreeSpace::Contains(const Eigen::Vector3f& x) const {
  if (x.squaredNorm() > sky_begin_ * sky_begin_) return true;
  if (cones_.empty() || (ground_ && ground_->Contains(x))) return false;
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
