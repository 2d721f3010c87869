// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/optim/initialization.h"

#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/model/activation.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/optim/point_thinning.h"
#include "foam/util/random_vectors.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Geometry>

namespace semfoam {
namespace {

constexpr uint64_t kThinPurpose = 0x1a1, kScatterPurpose = 0x1a2, kFarPurpose = 0x1a3,
                   kIdentityPurpose = 0x1a4, kClassifierPurpose = 0x1a5;

// Points begin half opaque or so across a cell of radius 0.01, empty space as a thin haze that
// colour can still turn to matter.
constexpr double kSeedDensity = 3;
constexpr double kScatteredDensity = 0.002;
// Largest distance of empty sites from the origin where there is sky, whose cells begin half-way to
// them.
constexpr double kFarthestBeforeSky = 0.5 * kFarRadius;

// Returns the box from the 2 % to the 98 % quantile of the points along each axis: the robust
// extent of the photographed scene.
Eigen::AlignedBox3f RobustBox(const std::vector<Eigen::Vector3f>& points) {
  Eigen::AlignedBox3f box;
  std::vector<float> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
    std::sort(values.begin(), values.end());
    const size_t skip = values.size() / 50;
    box.min()[axis] = values[skip];
    box.max()[axis] = values[values.size() - 1 - skip];
  }
  return box;
}

struct Site {
  Eigen::Vector3f position;
  // Display values, 0..1.
  Eigen::Vector3f color;
  double density;
};

// Returns `most` of the indices [0, count), drawn at random, ascending; all where these are no
// more.
std::vector<uint32_t> DrawSeeds(size_t count, size_t most, uint64_t seed) {
  std::vector<uint32_t> kept(count);
  std::iota(kept.begin(), kept.end(), 0u);
  if (count <= most) return kept;
  const auto key = [&](uint32_t i) { return CounterRandom(seed, kThinPurpose, i).Next(); };
  std::nth_element(kept.begin(), kept.begin() + most, kept.end(), [&](uint32_t a, uint32_t b) {
    return key(a) < key(b);
  });
  kept.resize(most);
  std::sort(kept.begin(), kept.end());
  return kept;
}

// Returns the number of SfM points, which come first.
size_t NumSfmPoints(const std::vector<SeedPoint>& seeds) {
  return static_cast<size_t>(
      std::find_if(seeds.begin(), seeds.end(), [](const SeedPoint& s) { return s.is_dense; }) -
      seeds.begin());
}

// Returns the sites at the points, and in the space around the points and cameras.
std::vector<Site> InitialSites(const std::vector<SeedPoint>& seeds,
                               const std::vector<Eigen::Vector3d>& camera_centers,
                               const InitializationOptions& options) {
  const Eigen::Vector3f grey = Eigen::Vector3f::Constant(0.5f);
  std::vector<Site> sites;
  std::vector<Eigen::Vector3f> extent;
  const size_t num_sfm = NumSfmPoints(seeds);
  const auto add = [&](const SeedPoint& seed) {
    if (!(seed.position.norm() <= kFarRadius) && !IsSkySite(seed.position)) return;
    sites.push_back({seed.position, seed.color, kSeedDensity});
    // A dense cloud may reach far into the background, of which SfM has few points.
    if (!seed.is_dense || num_sfm == 0) extent.push_back(seed.position);
  };
  for (const uint32_t i : DrawSeeds(num_sfm, options.max_seed_sites, options.seed)) add(seeds[i]);
  for (size_t i = num_sfm; i < seeds.size(); ++i) add(seeds[i]);
  for (const Eigen::Vector3d& center : camera_centers) extent.push_back(center.cast<float>());
  if (extent.empty()) extent.push_back(Eigen::Vector3f::Zero());

  const Eigen::AlignedBox3f box = RobustBox(extent);
  // Never flat, never beyond the far radius: a wall of points or a single camera still gets space
  // around it.
  const Eigen::Vector3f middle = box.center();
  const float longest = std::clamp(box.sizes().maxCoeff(), 1.f, kFarRadius);
  const Eigen::Vector3f half =
      (0.6f * box.sizes()).cwiseMax(0.3f * longest).cwiseMin(0.5f * kFarRadius);
  for (size_t i = 0; i < options.num_scattered; ++i) {
    CounterRandom random(options.seed, kScatterPurpose, i);
    const Eigen::Vector3f u = (2 * UniformVector(&random).array() - 1).cast<float>();
    const Eigen::Vector3f p = middle + half.cwiseProduct(u);
    if (p.norm() <= kFarRadius) sites.push_back({p, grey, kScatteredDensity});
  }
  const bool has_sky =
      std::any_of(sites.begin(), sites.end(), [](const Site& s) { return IsSkySite(s.position); });
  const double outer = has_sky ? kFarthestBeforeSky : kFarRadius;
  const double inner = std::min(double(half.norm()), 0.5 * outer);
  for (size_t i = 0; i < options.num_far; ++i) {
    CounterRandom random(options.seed, kFarPurpose, i);
    const double radius = inner * std::pow(outer / inner, random.Uniform());
    const Eigen::Vector3d direction = NormalVector(&random).normalized();
    if (!direction.allFinite()) continue;
    sites.push_back({(radius * 0.999 * direction).cast<float>(), grey, kScatteredDensity});
  }
  return sites;
}

// Draws identities and classifier: Xavier for the features, +-1/sqrt(16) for the classifier
// (Semantic Foam's initialisation).
void InitializeSemantics(uint64_t seed, Foam* foam) {
  const size_t n = foam->NumSites();
  const double bound = std::sqrt(6.0 / (n + kIdentityDim));
  for (size_t i = 0; i < n; ++i) {
    CounterRandom random(seed, kIdentityPurpose, i);
    for (int c = 0; c < kIdentityDim; ++c) {
      foam->identity.push_back(static_cast<float>(bound * (2 * random.Uniform() - 1)));
    }
  }
  for (int k = 0; k < foam->num_classes; ++k) {
    CounterRandom random(seed, kClassifierPurpose, k);
    for (int c = 0; c < kIdentityDim; ++c) {
      foam->classifier_weight.push_back(static_cast<float>(0.5 * random.Uniform() - 0.25));
    }
    foam->classifier_bias.push_back(static_cast<float>(0.5 * random.Uniform() - 0.25));
  }
}

}  // namespace

std::vector<SeedPoint> ThinDenseSeeds(std::vector<SeedPoint> seeds,
                                      const InitializationOptions& options) {
  const size_t num_sfm = NumSfmPoints(seeds);
  if (num_sfm == seeds.size()) return seeds;
  std::vector<Eigen::Vector3f> taken;
  for (const uint32_t i : DrawSeeds(num_sfm, options.max_seed_sites, options.seed)) {
    taken.push_back(seeds[i].position);
  }
  const std::vector<SeedPoint> dense(seeds.begin() + static_cast<int64_t>(num_sfm), seeds.end());
  seeds.resize(num_sfm);
  const size_t most = options.max_point_sites - std::min(options.max_point_sites, taken.size());
  const std::vector<SeedPoint> thinned = ThinPoints(dense, taken, most);
  seeds.insert(seeds.end(), thinned.begin(), thinned.end());
  return seeds;
}

float RawDensityOfSeed() { return static_cast<float>(RawDensity(kSeedDensity)); }

float ShOfSeedColor(float value) { return (value - 0.5f) / static_cast<float>(kShDc); }

Foam InitialFoam(const std::vector<SeedPoint>& seeds,
                 const std::vector<Eigen::Vector3d>& camera_centers,
                 const InitializationOptions& options) {
  const std::vector<Site> sites = InitialSites(seeds, camera_centers, options);
  const size_t n = sites.size();
  std::vector<Eigen::Vector3f> positions(n);
  for (size_t i = 0; i < n; ++i) positions[i] = sites[i].position;
  const std::vector<uint32_t> order = HilbertOrder(positions);

  Foam foam;
  foam.sh_degree = options.sh_degree;
  foam.num_classes = options.num_classes;
  foam.sh.assign(n * foam.ShStride(), 0.f);
  for (size_t k = 0; k < n; ++k) {
    const Site& site = sites[order[k]];
    foam.positions.push_back(site.position);
    foam.raw_density.push_back(static_cast<float>(RawDensity(site.density)));
    for (int c = 0; c < 3; ++c) {
      foam.sh[k * foam.ShStride() + c] = ShOfSeedColor(site.color[c]);
    }
  }
  if (foam.HasSemantics()) InitializeSemantics(options.seed, &foam);
  return foam;
}

}  // namespace semfoam
