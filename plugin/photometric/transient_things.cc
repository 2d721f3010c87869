// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/photometric/transient_things.h"

#include "foam/image/srgb.h"
#include "foam/util/median.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <tuple>
#include <utility>

#include <Eigen/Core>

namespace semfoam {
namespace {

constexpr float kLeastOpacity = 0.5f;
// Squares of differences of display values, the mean over channels: the noise of a photo beside its
// render, and from where on a difference counts, in the middle of a region and at its rim.
constexpr float kNoise = 0.0008f;
constexpr float kStrong = 0.004f;
constexpr float kWeak = 0.002f;
// Of the photo's own median, and of what photos usually show there, at the rim of a region.
constexpr float kWeakOwnRatio = 3;
constexpr float kWeakRatio = 3;
// Blocks that a region grows at most.
constexpr int kGrowth = 8;
// A region is of a mirrored lamp, perhaps, where this share of it is brighter than the render in
// all channels.
constexpr double kBrightShare = 0.7;
constexpr double kBrightFactor = 5;
// In a photo that is judged: its own median, and the share of the pixels outside the regions that
// differ by kStrong, at most.
constexpr float kMostOwn = 0.0008f;
constexpr double kMostSpoiled = 0.1;
// And its number of places at least: on coarser grids the opening leaves nothing below 1.5 % of the
// photo, and trainings so short have edges all over that are as large.
constexpr int64_t kFewestPlaces = 600;
// Edge of the finest voxels over the distance of samples, and the number of levels, each twice as
// coarse, on which a place is looked for.
constexpr float kVoxelOfSpacing = 1.5f;
constexpr int kNumLevels = 3;

using Bits = std::vector<uint8_t>;

// A photo's difference from its render, on the grid of a ComparedView.
struct Difference {
  // [rows][columns] Means over 3 x 3 pixels; 0 where nothing was rendered.
  std::vector<Eigen::Vector3f> signed_mean;
  std::vector<float> square;
  // Median of `square` over what was rendered.
  float own = 0;
  // [rows][columns] Whether a surface was rendered, where it lies, and how far the samples beside
  // it are.
  Bits is_surface;
  std::vector<Eigen::Vector3f> position;
  std::vector<float> spacing;
};

// Calls `function(j)` for each of the 3 x 3 places around i that is on the grid.
template <typename Function>
void ForEachAround(const ComparedView& grid, size_t i, const Function& function) {
  const int column = static_cast<int>(i) % grid.columns, row = static_cast<int>(i) / grid.columns;
  for (int y = std::max(row - 1, 0); y <= std::min(row + 1, grid.rows - 1); ++y) {
    for (int x = std::max(column - 1, 0); x <= std::min(column + 1, grid.columns - 1); ++x) {
      function(static_cast<size_t>(y) * grid.columns + x);
    }
  }
}

Difference Compare(const TrainingScene& scene,
                   const ComparedView& compared,
                   const std::vector<PhotoLight>& lights) {
  const int view = compared.view;
  const size_t count = compared.photo.size();
  Difference result;
  result.signed_mean.assign(count, Eigen::Vector3f::Zero());
  result.square.assign(count, 0);
  result.is_surface.assign(count, 0);
  result.position.assign(count, Eigen::Vector3f::Zero());
  result.spacing.assign(count, 0);
  std::vector<Eigen::Vector3f> difference(count, Eigen::Vector3f::Zero());
  const Eigen::Vector3f origin = scene.Origin(view).cast<float>();
  for (size_t i = 0; i < count; ++i) {
    const RenderedRay& ray = compared.rendered[i];
    Eigen::Vector3f direction, beside;
    if (ray.opacity < kLeastOpacity ||
        !scene.RayDirection(view, compared.X(i), compared.Y(i), &direction)) {
      continue;
    }
    result.is_surface[i] = 1;
    result.position[i] = origin + ray.distance * direction;
    const int step =
        compared.X(i) + compared.stride < scene.Width(view) ? compared.stride : -compared.stride;
    if (scene.RayDirection(view, compared.X(i) + step, compared.Y(i), &beside)) {
      result.spacing[i] = ray.distance * (beside - direction).norm();
    }
    Eigen::Vector3f render = ray.color;
    if (!lights.empty()) {
      const Eigen::Vector2d place = PlaceInPhoto(
          {compared.X(i) + 0.5, compared.Y(i) + 0.5}, scene.Width(view), scene.Height(view));
      render = PhotographedColor(render, lights[view], place);
    }
    difference[i] = compared.photo[i] - render.cwiseMax(0).cwiseMin(1);
  }
  std::vector<float> squares;
  for (size_t i = 0; i < count; ++i) {
    if (!result.is_surface[i]) continue;
    int num = 0;
    ForEachAround(compared, i, [&](size_t j) {
      if (!result.is_surface[j]) return;
      result.signed_mean[i] += difference[j];
      ++num;
    });
    result.signed_mean[i] /= static_cast<float>(num);
    result.square[i] = result.signed_mean[i].squaredNorm() / 3;
    squares.push_back(result.square[i]);
  }
  if (!squares.empty()) result.own = Median(std::move(squares));
  return result;
}

// A sample in a voxel of a level.
struct VoxelSample {
  std::array<int32_t, 4> voxel;  // level, x, y, z
  // Index of the photo and of its grid's place.
  int32_t photo;
  int32_t place;

  bool operator<(const VoxelSample& other) const {
    return std::tie(voxel, photo, place) < std::tie(other.voxel, other.photo, other.place);
  }
};

// Returns the level whose voxels fit samples at this distance from each other.
int LevelOf(float spacing) {
  return static_cast<int>(std::ceil(std::log2(kVoxelOfSpacing * spacing)));
}

// Returns what photos usually show at the place of each sample [photos][rows][columns]: the median
// over the photos of the mean square; negative where too few see it.
std::vector<std::vector<float>> UsualSquares(const std::vector<Difference>& photos) {
  // Voxels beyond this, of a level, are of no place that several photos look at closely.
  constexpr float kFarthest = 1e9f;
  std::vector<VoxelSample> samples;
  std::vector<std::vector<float>> usual(photos.size());
  for (size_t photo = 0; photo < photos.size(); ++photo) {
    const Difference& of_photo = photos[photo];
    usual[photo].assign(of_photo.square.size(), -1);
    for (size_t i = 0; i < of_photo.square.size(); ++i) {
      if (!of_photo.is_surface[i] || !(of_photo.spacing[i] > 0)) continue;
      const int finest = LevelOf(of_photo.spacing[i]);
      for (int level = finest; level < finest + kNumLevels; ++level) {
        const Eigen::Array3f at = (of_photo.position[i].array() * std::exp2(-level)).floor();
        if (!(at.abs().maxCoeff() < kFarthest)) continue;
        samples.push_back({{level,
                            static_cast<int32_t>(at.x()),
                            static_cast<int32_t>(at.y()),
                            static_cast<int32_t>(at.z())},
                           static_cast<int32_t>(photo),
                           static_cast<int32_t>(i)});
      }
    }
  }
  std::sort(samples.begin(), samples.end());
  // The level that `usual` is of; a finer one is better.
  std::vector<std::vector<int8_t>> level_of(photos.size());
  for (size_t photo = 0; photo < photos.size(); ++photo) {
    level_of[photo].assign(usual[photo].size(), INT8_MAX);
  }
  std::vector<float> means;
  for (size_t begin = 0, end; begin < samples.size(); begin = end) {
    means.clear();
    for (end = begin; end < samples.size() && samples[end].voxel == samples[begin].voxel;) {
      const int32_t photo = samples[end].photo;
      double sum = 0;
      int num = 0;
      for (; end < samples.size() && samples[end].voxel == samples[begin].voxel &&
             samples[end].photo == photo;
           ++end) {
        sum += photos[photo].square[samples[end].place];
        ++num;
      }
      means.push_back(static_cast<float>(sum / num));
    }
    if (std::ssize(means) < kFewestViews) continue;
    const float median = Median(means);
    for (size_t k = begin; k < end; ++k) {
      const VoxelSample& sample = samples[k];
      const auto level = static_cast<int8_t>(sample.voxel[0]);
      if (level >= level_of[sample.photo][sample.place]) continue;
      level_of[sample.photo][sample.place] = level;
      usual[sample.photo][sample.place] = median;
    }
  }
  return usual;
}

// Returns the places whose 3 x 3 neighbours are all set (`all`), or one of which is.
Bits Morph(const ComparedView& grid, const Bits& bits, bool all) {
  Bits result(bits.size());
  for (size_t i = 0; i < bits.size(); ++i) {
    bool every = true, any = false;
    ForEachAround(grid, i, [&](size_t j) {
      every = every && bits[j];
      any = any || bits[j];
    });
    result[i] = all ? every : any;
  }
  return result;
}

// Clears the regions, connected by edges, that are too small.
void KeepLargeRegions(const ComparedView& grid, const Difference& difference, Bits* bits) {
  Bits todo = *bits;
  std::vector<size_t> region;
  for (size_t first = 0; first < todo.size(); ++first) {
    if (!todo[first]) continue;
    region.assign(1, first);
    todo[first] = 0;
    int64_t num_bright = 0;
    for (size_t k = 0; k < region.size(); ++k) {
      const size_t i = region[k];
      num_bright += difference.signed_mean[i].minCoeff() > 0;
      const int column = static_cast<int>(i) % grid.columns;
      const auto visit = [&](size_t j) {
        if (todo[j]) region.push_back(j);
        todo[j] = 0;
      };
      if (column > 0) visit(i - 1);
      if (column + 1 < grid.columns) visit(i + 1);
      if (i >= static_cast<size_t>(grid.columns)) visit(i - grid.columns);
      if (i + grid.columns < todo.size()) visit(i + grid.columns);
    }
    const auto size = static_cast<double>(region.size());
    const bool is_bright = static_cast<double>(num_bright) >= kBrightShare * size;
    const double least = kLeastShare * (is_bright ? kBrightFactor : 1);
    if (size >= least * static_cast<double>(todo.size())) continue;
    for (const size_t i : region) (*bits)[i] = 0;
  }
}

// Returns the places of a photo that show something that passes by; empty where there is none or
// the photo is not judged.
Bits FindIn(const ComparedView& grid,
            const Difference& difference,
            const std::vector<float>& usual) {
  const size_t count = usual.size();
  if (difference.own > kMostOwn || std::ssize(usual) < kFewestPlaces) return {};
  Bits strong(count), weak(count);
  for (size_t i = 0; i < count; ++i) {
    const float square = difference.square[i];
    weak[i] = square > kWeak && square > kWeakOwnRatio * difference.own &&
              square > kWeakRatio * (std::max(usual[i], 0.0f) + kNoise);
    strong[i] = usual[i] >= 0 && usual[i] <= kMostUsual && square > kStrong &&
                square > kLeastRatio * (usual[i] + kNoise) &&
                square > kLeastOwnRatio * difference.own;
  }
  Bits found = Morph(grid, Morph(grid, strong, true), false);
  KeepLargeRegions(grid, difference, &found);
  if (std::find(found.begin(), found.end(), 1) == found.end()) return {};
  for (int step = 0; step < kGrowth; ++step) {
    const Bits grown = Morph(grid, found, false);
    for (size_t i = 0; i < count; ++i) found[i] = found[i] || (grown[i] && weak[i]);
  }
  found = Morph(grid, found, false);
  int64_t num_found = 0, num_rest = 0, num_spoiled = 0;
  for (size_t i = 0; i < count; ++i) {
    num_found += found[i];
    if (found[i] || !difference.is_surface[i]) continue;
    ++num_rest;
    num_spoiled += difference.square[i] > kStrong;
  }
  const bool is_judged =
      static_cast<double>(num_found) <= kMostShare * static_cast<double>(count) &&
      static_cast<double>(num_spoiled) <= kMostSpoiled * static_cast<double>(num_rest);
  return is_judged ? found : Bits();
}

}  // namespace

TransientFinder::TransientFinder(TrainingScene* scene, bool enabled)
    : scene_(scene), enabled_(enabled), blocks_(scene->NumViews()) {}

void TransientFinder::Find(const std::vector<ComparedView>& views,
                           const std::vector<PhotoLight>& lights) {
  if (!enabled_) return;
  const auto num_views = static_cast<int64_t>(views.size());
  std::vector<Difference> differences(views.size());
  ParallelForBlocks(num_views, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) differences[i] = Compare(*scene_, views[i], lights);
  });
  const std::vector<std::vector<float>> usual = UsualSquares(differences);
  for (int64_t i = 0; i < num_views; ++i) {
    PixelBlocks& blocks = blocks_[views[i].view];
    blocks.is_in = FindIn(views[i], differences[i], usual[i]);
    blocks.edge = blocks.is_in.empty() ? 0 : views[i].stride;
    blocks.columns = blocks.is_in.empty() ? 0 : views[i].columns;
  }
  looked_ = true;
  Restore();
}

void TransientFinder::Restore() {
  scene_->SetExcluded(NumPhotos() > 0 ? blocks_ : std::vector<PixelBlocks>());
}

int TransientFinder::NumPhotos() const {
  return static_cast<int>(std::count_if(
      blocks_.begin(), blocks_.end(), [](const PixelBlocks& of_view) { return of_view.edge > 0; }));
}

double TransientFinder::Share() const {
  double sum = 0;
  for (const PixelBlocks& of_view : blocks_) {
    if (of_view.edge == 0) continue;
    sum += static_cast<double>(std::count(of_view.is_in.begin(), of_view.is_in.end(), 1)) /
           static_cast<double>(of_view.is_in.size());
  }
  return sum / std::max(1, NumPhotos());
}

std::string TransientFinder::Report() const {
  if (NumPhotos() == 0) {
    return "Nothing passes by: no photo differs from what the others show of a place";
  }
  constexpr int kMostNames = 5;
  std::string names;
  int num_named = 0;
  for (size_t view = 0; view < blocks_.size() && num_named < kMostNames; ++view) {
    if (blocks_[view].edge == 0) continue;
    names += (num_named > 0 ? ", " : "") + scene_->Photos()[view].name;
    ++num_named;
  }
  char text[128];
  std::snprintf(text,
                sizeof(text),
                NumPhotos() == 1
                    ? "Something passes by in %d photo, which loses %.1f %% of its pixels: "
                    : "Something passes by in %d photos, which lose %.1f %% of their pixels: ",
                NumPhotos(),
                100 * Share());
  return text + names + (NumPhotos() > num_named ? ", ..." : "");
}

Effect TransientFinder::MakeEffect() const {
  Effect effect;
  effect.name = "transients";
  effect.on = NumPhotos() > 0;
  effect.by_option = !enabled_;
  effect.evidence = looked_ ? Report() : "not looked for";
  if (looked_) effect.measures["photos"] = NumPhotos();
  if (NumPhotos() > 0) effect.measures["share"] = Share();
  effect.cost = "1 byte a block of pixels";
  return effect;
}

}  // namespace semfoam
