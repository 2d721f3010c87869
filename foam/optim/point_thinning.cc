// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/optim/point_thinning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Of a key, for each axis.
constexpr int kBits = 21;
// The largest coordinate of a voxel: 1 + ln kSkyRadius is 4.4.
constexpr double kHalfExtent = 4.5;
constexpr double kSmallestEdge = 2 * kHalfExtent / (1 << kBits);

// Units of a sum of positions, of which 2^32 points within kSkyRadius have room in 63 bits.
constexpr double kPositionUnits = 1 << 26;
constexpr double kColorUnits = 65535;

Eigen::Vector3d Contract(const Eigen::Vector3d& x) {
  const double radius = x.norm();
  return radius <= 1 ? x : Eigen::Vector3d(x * ((1 + std::log(radius)) / radius));
}

std::array<uint64_t, 3> CellOf(const Eigen::Vector3d& contracted, double edge) {
  constexpr double kMiddle = 1 << (kBits - 1);
  constexpr double kLast = (1 << kBits) - 1;
  std::array<uint64_t, 3> cell;
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = static_cast<uint64_t>(
        std::clamp(std::floor(contracted[axis] / edge) + kMiddle, 0.0, kLast));
  }
  return cell;
}

uint64_t KeyOf(const Eigen::Vector3d& contracted, double edge) {
  const std::array<uint64_t, 3> cell = CellOf(contracted, edge);
  return cell[0] << (2 * kBits) | cell[1] << kBits | cell[2];
}

// Moves bit i of 21 to bit 3 i.
uint64_t Spread(uint64_t bits) {
  bits = (bits | bits << 32) & 0x001f00000000ffff;
  bits = (bits | bits << 16) & 0x001f0000ff0000ff;
  bits = (bits | bits << 8) & 0x100f00f00f00f00f;
  bits = (bits | bits << 4) & 0x10c30c30c30c30c3;
  return (bits | bits << 2) & 0x1249249249249249;
}

// Interleaves the bits, so that a shift by three gives the voxel of twice the edge.
uint64_t MortonKeyOf(const Eigen::Vector3d& contracted) {
  const std::array<uint64_t, 3> cell = CellOf(contracted, kSmallestEdge);
  return Spread(cell[0]) << 2 | Spread(cell[1]) << 1 | Spread(cell[2]);
}

std::vector<uint64_t> KeysOf(const std::vector<Eigen::Vector3d>& contracted, double edge) {
  std::vector<uint64_t> keys;
  keys.reserve(contracted.size());
  for (const Eigen::Vector3d& x : contracted) keys.push_back(KeyOf(x, edge));
  return keys;
}

std::vector<uint64_t> SortedKeysOf(const std::vector<Eigen::Vector3d>& contracted, double edge) {
  std::vector<uint64_t> keys = KeysOf(contracted, edge);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

// Returns the number of voxels with a point and none of `taken`.
size_t NumVoxels(const std::vector<Eigen::Vector3d>& points,
                 const std::vector<Eigen::Vector3d>& taken,
                 double edge) {
  const std::vector<uint64_t> keys = SortedKeysOf(points, edge);
  const std::vector<uint64_t> taken_keys = SortedKeysOf(taken, edge);
  size_t both = 0;
  auto other = taken_keys.begin();
  for (const uint64_t key : keys) {
    while (other != taken_keys.end() && *other < key) ++other;
    if (other != taken_keys.end() && *other == key) ++both;
  }
  return keys.size() - both;
}

// Returns the smallest edge found that leaves `most` voxels or fewer.
double FindEdge(const std::vector<Eigen::Vector3d>& points,
                const std::vector<Eigen::Vector3d>& taken,
                size_t most) {
  constexpr int kSteps = 11;  // 20 octaves / 2^11 are 0.7 %
  double fine = kSmallestEdge, coarse = 2 * kHalfExtent;
  for (int i = 0; i < kSteps; ++i) {
    const double edge = std::sqrt(fine * coarse);
    (NumVoxels(points, taken, edge) <= most ? coarse : fine) = edge;
  }
  return coarse;
}

std::vector<SeedPoint> WithoutTaken(const std::vector<SeedPoint>& points,
                                    const std::vector<Eigen::Vector3f>& taken) {
  const auto place = [](const Eigen::Vector3f& x) { return std::array{x.x(), x.y(), x.z()}; };
  std::set<std::array<float, 3>> places;
  for (const Eigen::Vector3f& x : taken) places.insert(place(x));
  std::vector<SeedPoint> kept;
  for (const SeedPoint& point : points) {
    if (places.count(place(point.position)) == 0) kept.push_back(point);
  }
  return kept;
}

}  // namespace

PointMerger::PointMerger(size_t most) : most_(most) { CHECK_GE(most, 8u); }

void PointMerger::Add(const Eigen::Vector3d& position, const Eigen::Vector3f& color) {
  Voxel voxel;
  voxel.key = MortonKeyOf(Contract(position)) >> (3 * level_);
  voxel.count = 1;
  for (int c = 0; c < 3; ++c) {
    voxel.position[c] = std::llround(position[c] * kPositionUnits);
    const double value = std::isnan(color[c]) ? 0.5 : std::clamp(color[c], 0.f, 1.f);
    voxel.color[c] = static_cast<uint64_t>(std::llround(value * kColorUnits));
  }
  voxels_.push_back(voxel);
  if (voxels_.size() >= 2 * most_) Merge();
}

// The edge is doubled only where the points so far occupy more than `most_` voxels, and all points
// occupy no fewer: whatever their order, the last edge is the same.
void PointMerger::Merge() {
  std::sort(
      voxels_.begin(), voxels_.end(), [](const Voxel& a, const Voxel& b) { return a.key < b.key; });
  while (true) {
    size_t num_kept = 0;
    for (size_t i = 0; i < voxels_.size(); ++i) {
      if (num_kept == 0 || voxels_[num_kept - 1].key != voxels_[i].key) {
        voxels_[num_kept++] = voxels_[i];
        continue;
      }
      Voxel& kept = voxels_[num_kept - 1];
      for (int c = 0; c < 3; ++c) {
        kept.position[c] += voxels_[i].position[c];
        kept.color[c] += voxels_[i].color[c];
      }
      kept.count += voxels_[i].count;
    }
    voxels_.resize(num_kept);
    if (num_kept <= most_) return;
    ++level_;
    for (Voxel& voxel : voxels_) voxel.key >>= 3;
  }
}

std::vector<SeedPoint> PointMerger::Take() {
  Merge();
  std::vector<SeedPoint> points;
  points.reserve(voxels_.size());
  for (const Voxel& voxel : voxels_) {
    SeedPoint& point = points.emplace_back();
    point.is_dense = true;
    const auto count = static_cast<double>(voxel.count);
    for (int c = 0; c < 3; ++c) {
      point.position[c] =
          static_cast<float>(static_cast<double>(voxel.position[c]) / (kPositionUnits * count));
      point.color[c] =
          static_cast<float>(static_cast<double>(voxel.color[c]) / (kColorUnits * count));
    }
  }
  voxels_ = {};
  level_ = 0;
  return points;
}

std::vector<SeedPoint> ThinPoints(const std::vector<SeedPoint>& points,
                                  const std::vector<Eigen::Vector3f>& taken,
                                  size_t most) {
  if (points.size() <= most) return WithoutTaken(points, taken);
  if (most == 0) return {};
  std::vector<Eigen::Vector3d> contracted, contracted_taken;
  contracted.reserve(points.size());
  for (const SeedPoint& point : points)
    contracted.push_back(Contract(point.position.cast<double>()));
  for (const Eigen::Vector3f& x : taken) contracted_taken.push_back(Contract(x.cast<double>()));
  const double edge = FindEdge(contracted, contracted_taken, most);

  const std::vector<uint64_t> keys = KeysOf(contracted, edge);
  const std::vector<uint64_t> taken_keys = SortedKeysOf(contracted_taken, edge);
  std::vector<uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return keys[a] != keys[b] ? keys[a] < keys[b] : a < b;
  });
  std::vector<SeedPoint> thinned;
  for (size_t begin = 0, end = 0; begin < order.size() && thinned.size() < most; begin = end) {
    const uint64_t key = keys[order[begin]];
    Eigen::Vector3d position = Eigen::Vector3d::Zero(), color = Eigen::Vector3d::Zero();
    for (; end < order.size() && keys[order[end]] == key; ++end) {
      position += points[order[end]].position.cast<double>();
      color += points[order[end]].color.cast<double>();
    }
    if (std::binary_search(taken_keys.begin(), taken_keys.end(), key)) continue;
    const auto count = static_cast<double>(end - begin);
    thinned.push_back(
        {(position / count).cast<float>(), (color / count).cast<float>(), /*is_dense=*/true});
  }
  return thinned;
}

}  // namespace semfoam
