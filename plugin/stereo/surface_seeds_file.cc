// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/surface_seeds_file.h"

#include "foam/train/checkpoint.h"
#include "foam/train/checkpoint_state.h"

#include <cstdint>
#include <utility>

namespace semfoam {
namespace {

constexpr char kGroup[] = "sweep";

// A sweep as the file has it: the vectors of all points, and of all views one after the other.
struct FlatSweep {
  SurfaceSeeds numbers;  // without the vectors
  std::vector<Eigen::Vector3f> positions, colors;
  // [views]
  std::vector<int32_t> widths, heights;
  std::vector<Eigen::Vector2f> focals, centers;
  std::vector<float> inverse_depths;
  // One, or none.
  std::vector<SolidGround> ground;

  template <typename Archive>
  void Serialize(Archive* archive) {
    size_t num_points = positions.size(), num_views = widths.size(), num_grounds = ground.size();
    archive->Number("points", &num_points);
    archive->Number("views", &num_views);
    archive->Number("grounds", &num_grounds);
    archive->Number("far_share", &numbers.far_share);
    archive->Number("num_far", &numbers.num_far);
    archive->Number("has_ground", &numbers.has_ground);
    archive->Number("has_support", &numbers.has_support);
    archive->Number("num_swept", &numbers.num_swept);
    archive->Number("num_training", &numbers.num_training);
    archive->Number("seconds", &numbers.seconds);
    archive->Array("positions", &positions, num_points);
    archive->Array("colors", &colors, num_points);
    archive->Array("widths", &widths, num_views);
    archive->Array("heights", &heights, num_views);
    archive->Array("focals", &focals, num_views);
    archive->Array("centers", &centers, num_views);
    archive->Array("ground", &ground, num_grounds);
    size_t num_pixels = 0;
    for (size_t i = 0; i < num_views; ++i) num_pixels += PixelsOf(i);
    archive->Array("inverse_depths", &inverse_depths, num_pixels);
  }

  size_t PixelsOf(size_t view) const {
    return static_cast<size_t>(widths[view]) * static_cast<size_t>(heights[view]);
  }
};

}  // namespace

void WriteSurfaceSeeds(const std::filesystem::path& path, const SurfaceSeeds& found) {
  FlatSweep flat;
  flat.numbers.far_share = found.far_share;
  flat.numbers.num_far = found.num_far;
  flat.numbers.has_ground = found.has_ground;
  flat.numbers.has_support = found.has_support;
  flat.numbers.num_swept = found.num_swept;
  flat.numbers.num_training = found.num_training;
  flat.numbers.seconds = found.seconds;
  for (const SeedPoint& point : found.points) {
    flat.positions.push_back(point.position);
    flat.colors.push_back(point.color);
  }
  for (const PhotoDepths& depths : found.depths) {
    flat.widths.push_back(depths.width);
    flat.heights.push_back(depths.height);
    flat.focals.push_back(depths.focal);
    flat.centers.push_back(depths.center);
    flat.inverse_depths.insert(
        flat.inverse_depths.end(), depths.inverse.begin(), depths.inverse.end());
  }
  if (found.solid_ground) flat.ground.push_back(*found.solid_ground);
  CheckpointContents contents;
  StateWriter writer(kGroup, &contents);
  flat.Serialize(&writer);
  WriteCheckpoint(path, contents);
}

SurfaceSeeds ReadSurfaceSeeds(const std::filesystem::path& path, int num_views) {
  const Checkpoint file(path, /*keeps=*/{}, kRemedyOfSplit);
  StateReader reader(kGroup, file);
  FlatSweep flat;
  flat.Serialize(&reader);
  if (!flat.widths.empty() && std::ssize(flat.widths) != num_views) {
    file.ThrowDamaged("it is of another number of photos");
  }
  SurfaceSeeds found = std::move(flat.numbers);
  found.points.reserve(flat.positions.size());
  for (size_t i = 0; i < flat.positions.size(); ++i) {
    found.points.push_back({flat.positions[i], flat.colors[i], /*is_dense=*/true});
  }
  auto begin = flat.inverse_depths.begin();
  for (size_t i = 0; i < flat.widths.size(); ++i) {
    const auto end = begin + static_cast<std::ptrdiff_t>(flat.PixelsOf(i));
    found.depths.push_back(
        {flat.widths[i], flat.heights[i], flat.focals[i], flat.centers[i], {begin, end}});
    begin = end;
  }
  if (!flat.ground.empty()) found.solid_ground = flat.ground.front();
  return found;
}

}  // namespace semfoam
