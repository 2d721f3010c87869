// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/block_sites.h"

#include "foam/geometry/site_tree.h"
#include "foam/optim/point_thinning.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <glog/logging.h>

namespace semfoam {

size_t StartSites::NumFrozen() const {
  return static_cast<size_t>(std::count(is_frozen.begin(), is_frozen.end(), 1));
}

StartSites ChooseStartSites(std::span<const Eigen::Vector3f> positions,
                            const BlockBox& padded,
                            const std::vector<uint8_t>& is_met) {
  CHECK_EQ(positions.size(), is_met.size());
  StartSites sites;
  for (size_t i = 0; i < positions.size(); ++i) {
    const bool is_inside = padded.Contains(positions[i]);
    if (!is_met[i] && !is_inside) continue;
    sites.origin.push_back(static_cast<uint32_t>(i));
    sites.is_frozen.push_back(!is_inside);
  }
  sites.is_new.assign(sites.origin.size(), 0);
  return sites;
}

void AddSitesAtSeeds(const std::vector<SeedPoint>& seeds,
                     std::span<const Eigen::Vector3f> positions,
                     const BlockBox& padded,
                     int64_t most,
                     StartSites* sites) {
  std::vector<uint32_t> trained;  // places in `sites`
  std::vector<Eigen::Vector3f> taken;
  for (uint32_t k = 0; k < sites->origin.size(); ++k) {
    if (sites->is_frozen[k]) continue;
    trained.push_back(k);
    taken.push_back(positions[sites->origin[k]]);
  }
  const int64_t missing = most - std::ssize(trained);
  if (trained.empty() || missing <= 0) return;
  std::vector<SeedPoint> inside;
  for (const SeedPoint& seed : seeds) {
    if (padded.Contains(seed.position)) inside.push_back(seed);
  }
  const std::vector<SeedPoint> points = ThinPoints(inside, taken, static_cast<size_t>(missing));

  std::vector<uint32_t> all(taken.size());
  for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  const SiteTree tree(taken, std::move(all));
  // [sites] The points nearest to each.
  std::vector<std::vector<uint32_t>> near(sites->origin.size());
  for (uint32_t p = 0; p < points.size(); ++p) {
    constexpr double kAnywhere = std::numeric_limits<double>::infinity();
    const Eigen::Vector3d position = points[p].position.cast<double>();
    near[trained[tree.Nearest(position, kAnywhere, 1).front()]].push_back(p);
  }
  StartSites result;
  const auto add = [&](size_t k, bool is_new) {
    result.origin.push_back(sites->origin[k]);
    result.is_frozen.push_back(sites->is_frozen[k]);
    result.is_new.push_back(is_new);
  };
  for (size_t k = 0; k < near.size(); ++k) {
    add(k, false);
    for (const uint32_t p : near[k]) {
      add(k, true);
      result.points.push_back(points[p]);
    }
  }
  *sites = std::move(result);
}

}  // namespace semfoam
