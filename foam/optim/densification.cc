// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/optim/densification.h"

#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/util/array_rows.h"
#include "foam/util/random_vectors.h"

#include <algorithm>
#include <cmath>

namespace semfoam {
namespace {

constexpr uint64_t kDrawPurpose = 0xd3a1, kPlacePurpose = 0xd3a2;

// Returns the k sites with the largest keys ln(u) / weight: a weighted draw without replacement
// (Efraimidis and Spirakis 2006). Sites of weight 0 are never drawn. Ascending.
std::vector<uint32_t> DrawWithoutReplacement(const std::vector<float>& weights,
                                             size_t k,
                                             uint64_t seed,
                                             uint64_t event) {
  std::vector<std::pair<double, uint32_t>> keys;
  for (uint32_t i = 0; i < weights.size(); ++i) {
    if (!(weights[i] > 0) || !std::isfinite(weights[i])) continue;
    const uint64_t stream = event << 32 | i;
    const double u = 1 - CounterRandom(seed, kDrawPurpose, stream).Uniform();
    keys.emplace_back(std::log(u) / weights[i], i);
  }
  k = std::min(k, keys.size());
  std::nth_element(keys.begin(), keys.begin() + k, keys.end(), std::greater<>());
  std::vector<uint32_t> drawn(k);
  for (size_t i = 0; i < k; ++i) drawn[i] = keys[i].second;
  std::sort(drawn.begin(), drawn.end());
  return drawn;
}

Eigen::Vector3f RandomUnitVector(CounterRandom* random) {
  while (true) {
    const Eigen::Vector3d v = NormalVector(random);
    if (v.norm() > 1e-6) return v.normalized().cast<float>();
  }
}

// From a site to the farthest of its neighbours that qualify, guards never; zero if none does.
template <typename Predicate>
Eigen::Vector3f ToFarthestNeighbor(const Foam& foam,
                                   const Delaunay& delaunay,
                                   uint32_t site,
                                   Predicate&& qualifies) {
  Eigen::Vector3f to_farthest = Eigen::Vector3f::Zero();
  for (const uint32_t j : delaunay.Neighbors(site)) {
    if (j >= delaunay.num_sites || !qualifies(j)) continue;
    const Eigen::Vector3f offset = foam.positions[j] - foam.positions[site];
    if (offset.squaredNorm() > to_farthest.squaredNorm()) to_farthest = offset;
  }
  return to_farthest;
}

}  // namespace

Rearrangement PlanDensification(const Delaunay& delaunay,
                                const DensificationStatistics& statistics,
                                const DensificationOptions& options,
                                uint64_t seed,
                                uint64_t event,
                                const Foam& foam) {
  const uint32_t n = delaunay.num_sites;
  const std::vector<float> radii = CellRadii(WithGuardSites(foam.positions), delaunay);
  const auto& contribution = statistics.contribution;

  std::vector<uint8_t> pruned(n, 0);
  for (uint32_t i = 0; i < n; ++i) {
    if (contribution[i] > options.prune_contribution || radii[i] >= options.prune_radius) continue;
    const auto around = delaunay.Neighbors(i);
    pruned[i] = std::all_of(around.begin(), around.end(), [&](uint32_t j) {
      return j >= n || contribution[j] <= options.prune_contribution;
    });
  }

  std::vector<float> score(n);
  for (uint32_t i = 0; i < n; ++i) score[i] = pruned[i] ? 0.f : statistics.squared_error[i];
  const std::vector<uint32_t> parents =
      DrawWithoutReplacement(score, options.num_to_add, seed, event);

  Rearrangement result;
  std::vector<Eigen::Vector3f>& positions = result.positions;
  for (uint32_t i = 0; i < n; ++i) {
    if (pruned[i]) continue;
    result.origin.push_back(i);
    positions.push_back(foam.positions[i]);
  }
  result.num_pruned = n - positions.size();
  result.is_new.assign(positions.size(), 0);
  for (const uint32_t parent : parents) {
    const Eigen::Vector3f p = foam.positions[parent];
    const bool is_sky = IsSkySite(p);
    const auto may_lead = [&](uint32_t j) { return !is_sky || IsSkySite(foam.positions[j]); };
    // Along the surface, where there is one.
    Eigen::Vector3f to_farthest = ToFarthestNeighbor(foam, delaunay, parent, [&](uint32_t j) {
      return contribution[j] >= options.seen_contribution && may_lead(j);
    });
    if (to_farthest.isZero(0)) to_farthest = ToFarthestNeighbor(foam, delaunay, parent, may_lead);
    if (to_farthest.isZero(0)) continue;  // only guards around it
    CounterRandom random(seed, kPlacePurpose, event << 32 | parent);
    const Eigen::Vector3f step = 0.25f * to_farthest;
    Eigen::Vector3f child = p + step + 0.1f * step.norm() * RandomUnitVector(&random);
    if (is_sky) child *= p.norm() / child.norm();
    if ((!is_sky && child.norm() > kFarRadius) || child == p) continue;
    result.origin.push_back(parent);
    result.is_new.push_back(1);
    positions.push_back(child);
  }
  result.num_added = result.origin.size() - (n - result.num_pruned);

  const std::vector<uint32_t> order = HilbertOrder(positions);
  Gather(order, 1, &result.origin);
  Gather(order, 1, &result.is_new);
  Gather(order, 1, &positions);
  return result;
}

void Rearrange(const Rearrangement& plan,
               const DensificationStatistics& statistics,
               const DensificationOptions& options,
               Foam* foam) {
  for (size_t i = 0; i < foam->NumSites(); ++i) {
    foam->raw_density[i] = FadedRawDensity(foam->raw_density[i],
                                           foam->positions[i],
                                           statistics.contribution[i],
                                           options.transparent_contribution);
  }
  Gather(plan.origin, 1, &foam->positions);
  std::vector<Eigen::Vector3f> moved(plan.origin.size(), Eigen::Vector3f::Zero());
  for (size_t k = 0; k < plan.origin.size(); ++k) {
    if (!plan.is_new[k]) continue;
    moved[k] = plan.positions[k] - foam->positions[k];
    foam->positions[k] = plan.positions[k];
  }
  Gather(plan.origin, 1, &foam->raw_density);
  Gather(plan.origin, foam->ShStride(), &foam->sh);
  if (foam->HasColorGradients()) {
    Gather(plan.origin, kColorGradientDim, &foam->color_gradient);
    for (size_t k = 0; k < plan.origin.size(); ++k) {
      ShiftColor(
          moved[k], &foam->color_gradient[k * kColorGradientDim], &foam->sh[k * foam->ShStride()]);
    }
  }
  Gather(plan.origin, kIdentityDim, &foam->identity);
}

}  // namespace semfoam
