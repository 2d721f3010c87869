// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/benchmark/scenes.h"

#include "foam/geometry/delaunay.h"
#include "foam/model/activation.h"
#include "foam/model/model.h"
#include "foam/util/error.h"
#include "foam/util/parallel.h"
#include "foam/util/random.h"
#include "plugin/colmap/camera_rays.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>
#include <numbers>
#include <random>
#include <utility>

namespace semfoam {
namespace {

constexpr double kShellRadius = 0.4;
constexpr double kShellDeviation = 0.002;
constexpr double kBoxHalfExtent = 2;
constexpr int kShellOfTen = 7;  // so many of ten sites are the shell's
constexpr int kShDegree = 2;
constexpr int kNumClasses = 16;
// The raw density below which the optimiser lets no cell fall; half of a trained foam's air is
// there.
constexpr float kAirRawDensity = -1;

constexpr uint64_t kParameterPurpose = 0xbe1, kTilePurpose = 0xbe2, kQuantilePurpose = 0xbe3;

Foam ShellFoam(int64_t num_sites) {
  ShellSites sites = MakeShellSites(num_sites);
  Foam foam;
  foam.sh_degree = kShDegree;
  foam.num_classes = kNumClasses;
  foam.positions = std::move(sites.positions);
  const double shell_area = 4 * std::numbers::pi * kShellRadius * kShellRadius;
  const double spacing = std::sqrt(shell_area / (0.1 * kShellOfTen * num_sites));
  const float shell_raw_density = static_cast<float>(RawDensity(1 / spacing));
  for (const uint8_t is_shell : sites.is_shell) {
    foam.raw_density.push_back(is_shell != 0 ? shell_raw_density : kAirRawDensity);
  }
  CounterRandom random(/*seed=*/0, kParameterPurpose, /*index=*/0);
  const auto fill = [&](size_t count, double scale, auto* values) {
    values->resize(count);
    for (float& value : *values) value = static_cast<float>(scale * (2 * random.Uniform() - 1));
  };
  fill(num_sites * foam.ShStride(), 0.2, &foam.sh);
  fill(num_sites * kColorGradientDim, 0.2 / spacing, &foam.color_gradient);
  fill(num_sites * kIdentityDim, 1, &foam.identity);
  fill(kNumClasses * kIdentityDim, 1, &foam.classifier_weight);
  fill(kNumClasses, 1, &foam.classifier_bias);
  return foam;
}

// Returns a camera at (0.9, 0.7, 0.5) that looks at the sphere's centre, z upwards, focal length
// 500 pixels.
CameraRays ShellCamera() {
  CameraRays rays;
  rays.width = 640;
  rays.height = 480;
  rays.origin = Eigen::Vector3d(0.9, 0.7, 0.5);
  const Eigen::Vector3d forward = -rays.origin.normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  const Eigen::Vector3d down = forward.cross(right);
  for (int y = 0; y < rays.height; ++y) {
    for (int x = 0; x < rays.width; ++x) {
      const double a = (x + 0.5 - 0.5 * rays.width) / 500, b = (y + 0.5 - 0.5 * rays.height) / 500;
      rays.directions.push_back((forward + a * right + b * down).normalized().cast<float>());
    }
  }
  return rays;
}

struct ViewSize {
  int width, height;
};

// kNumBatches batches of the pixels of some views. `rays_of` is called once for each view, so that
// the rays of one view at a time are held. Pixels without a ray are left out.
std::vector<std::vector<BatchRay>> DrawBatches(
    const std::vector<ViewSize>& sizes,
    const std::function<CameraRays(size_t view)>& rays_of,
    const ViewRenderer& renderer,
    int num_classes) {
  constexpr int kTileSide = 2, kTileStep = 2, kTileRays = kTileSide * kTileSide;
  std::vector<int64_t> ends;  // of the views in the range of all pixels
  ends.reserve(sizes.size());
  for (const ViewSize& size : sizes) {
    ends.push_back((ends.empty() ? 0 : ends.back()) + int64_t{size.width} * size.height);
  }
  const int64_t num_pixels = ends.empty() ? 0 : ends.back();
  struct Tile {
    int batch;
    int64_t pixel;
  };
  std::vector<Tile> tiles;
  for (int batch = 0; batch < kNumBatches; ++batch) {
    for (int i = 0; i < kBatchRays / kTileRays; ++i) {
      CounterRandom random(/*seed=*/0, kTilePurpose, tiles.size());
      tiles.push_back({batch, static_cast<int64_t>(random.Uniform() * num_pixels)});
    }
  }
  std::stable_sort(
      tiles.begin(), tiles.end(), [](const Tile& a, const Tile& b) { return a.pixel < b.pixel; });

  std::vector<std::vector<BatchRay>> batches(kNumBatches);
  int64_t drawn = 0;
  auto tile = tiles.begin();
  for (size_t view = 0; view < sizes.size(); ++view) {
    const int64_t begin = view == 0 ? 0 : ends[view - 1];
    if (tile == tiles.end() || tile->pixel >= ends[view]) continue;
    const CameraRays rays = rays_of(view);
    const uint32_t start_cell = renderer.StartCell(rays.origin);
    for (; tile != tiles.end() && tile->pixel < ends[view]; ++tile) {
      for (int in_tile = 0; in_tile < kTileRays; ++in_tile) {
        const int64_t corner = tile->pixel - begin;
        const int64_t x = (corner % rays.width + kTileStep * (in_tile % kTileSide)) % rays.width;
        const int64_t y = (corner / rays.width + kTileStep * (in_tile / kTileSide)) % rays.height;
        BatchRay ray;
        ray.direction = rays.directions[y * rays.width + x];
        if (ray.direction.isZero(0)) continue;
        ray.origin = rays.origin.cast<float>();
        ray.start_cell = start_cell;
        CounterRandom random(/*seed=*/0, kQuantilePurpose, drawn++);
        const double tau0 = -std::log(1 - random.Uniform()), tau1 = -std::log(1 - random.Uniform());
        ray.quantile_tau[0] = static_cast<float>(std::min(tau0, tau1));
        ray.quantile_tau[1] = static_cast<float>(std::max(tau0, tau1));
        std::fill_n(ray.target.color, 3, 0.5f);
        if (num_classes > 0) ray.target.class_index = static_cast<int32_t>(drawn % num_classes);
        batches[tile->batch].push_back(ray);
      }
    }
  }
  return batches;
}

Foam WithAppearance(Foam foam, Appearance appearance) {
  if (appearance == Appearance::kFull) return foam;
  LargePageVector<float> sh(3 * foam.NumSites());
  for (size_t i = 0; i < foam.NumSites(); ++i) {
    std::copy_n(&foam.sh[i * foam.ShStride()], 3, &sh[3 * i]);
  }
  foam.sh = std::move(sh);
  foam.color_gradient.clear();
  foam.sh_degree = 0;
  foam.num_classes = 0;
  foam.identity.clear();
  foam.classifier_weight.clear();
  foam.classifier_bias.clear();
  return foam;
}

std::shared_ptr<const BenchmarkScene> MakeShellScene(int64_t num_sites, Appearance appearance) {
  auto scene = std::make_shared<BenchmarkScene>(WithAppearance(ShellFoam(num_sites), appearance));
  CameraRays rays = ShellCamera();
  const uint32_t start_cell = scene->renderer.StartCell(rays.origin);
  for (const Eigen::Vector3f& direction : rays.directions) {
    scene->rays.push_back({rays.origin.cast<float>(), direction, start_cell});
  }
  scene->batches = DrawBatches(
      {{rays.width, rays.height}},
      [&](size_t) { return rays; },
      scene->renderer,
      scene->foam.num_classes);
  return scene;
}

std::shared_ptr<const BenchmarkScene> MakeTrainedScene(const std::filesystem::path& foam_file,
                                                       Appearance appearance) {
  Model model = ReadModel(foam_file);
  std::vector<const PhotoRecord*> photos;
  std::vector<ViewSize> sizes;
  for (const PhotoRecord& photo : model.photos) {
    if (photo.held_out) continue;
    photos.push_back(&photo);
    sizes.push_back({photo.width, photo.height});
  }
  auto scene = std::make_shared<BenchmarkScene>(WithAppearance(std::move(model.foam), appearance));
  scene->batches = DrawBatches(
      sizes,
      [&](size_t view) {
        return MakeCameraRays(*photos[view], model.world_from_normalized, foam_file);
      },
      scene->renderer,
      scene->foam.num_classes);
  for (const auto& batch : scene->batches) {
    for (const BatchRay& ray : batch) {
      scene->rays.push_back({ray.origin, ray.direction, ray.start_cell});
    }
  }
  if (scene->rays.empty()) {
    throw UserError(foam_file.string(), ": holds no photo to cast rays from.");
  }
  return scene;
}

std::string Key(const std::string& scene, Appearance appearance) {
  return (appearance == Appearance::kPlain ? "plain " : "full ") + scene;
}

// The scene that was asked for last. Made on all cores, whatever the case at hand runs on.
std::shared_ptr<const BenchmarkScene> Kept(
    const std::string& key, const std::function<std::shared_ptr<const BenchmarkScene>()>& make) {
  static std::mutex mutex;
  static std::string kept_key;
  static std::shared_ptr<const BenchmarkScene> kept;
  const std::lock_guard<std::mutex> lock(mutex);
  if (key != kept_key) {
    kept.reset();
    kept_key.clear();
    kept = make();
    kept_key = key;
  }
  return kept;
}

}  // namespace

ShellSites MakeShellSites(int64_t num_sites) {
  std::mt19937 generator(1);
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Eigen::Vector3f> positions;
  for (int64_t i = 0; i < num_sites; ++i) {
    Eigen::Vector3d site;
    if (i % 10 < kShellOfTen) {
      for (double& x : site) x = normal(generator);
      site *= (kShellRadius + kShellDeviation * normal(generator)) / site.norm();
    } else {
      // z before y before x: the order fixes the scene.
      for (const int axis : {2, 1, 0}) site[axis] = kBoxHalfExtent * uniform(generator);
    }
    positions.push_back(site.cast<float>());
  }
  ShellSites sites;
  for (const uint32_t k : HilbertOrder(positions)) {
    sites.positions.push_back(positions[k]);
    sites.is_shell.push_back(k % 10 < kShellOfTen);
  }
  return sites;
}

std::shared_ptr<const BenchmarkScene> ShellScene(int64_t num_sites, Appearance appearance) {
  return Kept(Key(std::to_string(num_sites), appearance),
              [&] { return MakeShellScene(num_sites, appearance); });
}

std::shared_ptr<const BenchmarkScene> TrainedScene(const std::filesystem::path& foam_file,
                                                   Appearance appearance) {
  return Kept(Key(foam_file.string(), appearance),
              [&] { return MakeTrainedScene(foam_file, appearance); });
}

}  // namespace semfoam
