// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/optim/densification.h"

#include "foam/geometry/guard_sites.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/render/ray_record.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/foam/random_cells.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// A foam whose every parameter tells which site it belongs to.
Foam MarkedFoam(int num_sites) {
  Foam foam;
  foam.sh_degree = 1;
  foam.num_classes = 2;
  foam.positions = RandomSites(num_sites, 1);
  for (int i = 0; i < num_sites; ++i) {
    foam.raw_density.push_back(i);
    for (int k = 0; k < foam.ShStride(); ++k) foam.sh.push_back(1000 * i + k);
    for (int k = 0; k < kIdentityDim; ++k) foam.identity.push_back(-1000 * i - k);
  }
  return foam;
}

// Planned and carried out at once.
Rearrangement Densify(const Delaunay& delaunay,
                      const DensificationStatistics& statistics,
                      const DensificationOptions& options,
                      uint64_t seed,
                      uint64_t event,
                      Foam* foam) {
  const Rearrangement plan = PlanDensification(delaunay, statistics, options, seed, event, *foam);
  Rearrange(plan, statistics, options, foam);
  EXPECT_EQ(foam->positions, plan.positions);
  return plan;
}

void ExpectParametersFollow(const Foam& before, const Foam& after, const Rearrangement& how) {
  ASSERT_EQ(how.origin.size(), after.NumSites());
  for (size_t k = 0; k < after.NumSites(); ++k) {
    const size_t from = how.origin[k];
    if (!how.is_new[k]) {
      ASSERT_EQ(after.positions[k], before.positions[from]);
    }
    ASSERT_EQ(after.raw_density[k], before.raw_density[from]);
    for (int c = 0; c < before.ShStride(); ++c) {
      ASSERT_EQ(after.sh[k * before.ShStride() + c], before.sh[from * before.ShStride() + c]);
    }
    for (int c = 0; c < kIdentityDim; ++c) {
      ASSERT_EQ(after.identity[k * kIdentityDim + c], before.identity[from * kIdentityDim + c]);
    }
  }
}

TEST(Densification, AddsChildrenOfErroneousCellsAndMovesParametersAlong) {
  const WalkableCells cells(RandomSites(400, 1));
  const Foam before = MarkedFoam(400);
  DensificationStatistics statistics;
  statistics.Reset(400);
  std::fill(statistics.contribution.begin(), statistics.contribution.end(), 0.5f);
  for (int i = 0; i < 40; ++i) statistics.squared_error[i] = 1;  // only these may have children
  Foam after = before;
  DensificationOptions options;
  options.num_to_add = 30;
  const Rearrangement how = Densify(cells.delaunay, statistics, options, 1, 0, &after);
  EXPECT_EQ(how.num_pruned, 0u);
  EXPECT_EQ(how.num_added, 30u);
  EXPECT_EQ(after.NumSites(), 430u);
  ExpectParametersFollow(before, after, how);
  std::vector<int> copies(400, 0);
  for (size_t k = 0; k < after.NumSites(); ++k) {
    ++copies[how.origin[k]];
    if (!how.is_new[k]) continue;
    EXPECT_LT(how.origin[k], 40u);
    EXPECT_NE(after.positions[k], before.positions[how.origin[k]]);
  }
  EXPECT_EQ(*std::max_element(copies.begin(), copies.end()), 2) << "drawn without replacement";
}

// A child shows at every place what its parent shows there.
TEST(Densification, ChildrenTakeOverTheColourAtTheirPlace) {
  const WalkableCells cells(RandomSites(400, 1));
  Foam before = MarkedFoam(400);
  CounterRandom random(3, 0x61, 0);
  for (float& c : before.sh) c = static_cast<float>(random.Normal());
  for (size_t k = 0; k < before.NumSites() * kColorGradientDim; ++k) {
    before.color_gradient.push_back(static_cast<float>(random.Normal()));
  }
  DensificationStatistics statistics;
  statistics.Reset(400);
  std::fill(statistics.contribution.begin(), statistics.contribution.end(), 0.5f);
  std::fill(statistics.squared_error.begin(), statistics.squared_error.end(), 1.f);
  DensificationOptions options;
  options.num_to_add = 100;
  Foam after = before;
  const Rearrangement how = Densify(cells.delaunay, statistics, options, 1, 0, &after);
  ASSERT_GT(how.num_added, 50u);
  const Eigen::Vector3f direction = RandomDirection(&random).cast<float>(), x(0.1f, -0.2f, 0.3f);
  float basis[kMaxShCoefficients];
  ShBasis(1, direction, basis);
  // Neither colour is clamped at black, so that the sums are compared.
  const auto sum_at_x = [&](const Foam& foam, size_t i) {
    const float* const sh = &foam.sh[i * foam.ShStride()];
    const float* const gradient = &foam.color_gradient[i * kColorGradientDim];
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (int c = 0; c < 3; ++c) {
      for (int k = 0; k < 4; ++k) sum[c] += basis[k] * sh[3 * k + c];
      for (int a = 0; a < 3; ++a) sum[c] += (x - foam.positions[i])[a] * gradient[3 * a + c];
    }
    return sum;
  };
  for (size_t k = 0; k < after.NumSites(); ++k) {
    ASSERT_LT((sum_at_x(after, k) - sum_at_x(before, how.origin[k])).norm(), 1e-5f) << k;
  }
}

TEST(Densification, PlacesChildrenTowardsTheFarthestNeighbourThatIsSeen) {
  const WalkableCells cells(RandomSites(400, 1));
  const Foam before = MarkedFoam(400);
  DensificationStatistics statistics;
  statistics.Reset(400);
  const auto is_seen = [&](uint32_t j) { return std::abs(before.positions[j].z()) < 0.2f; };
  for (uint32_t i = 0; i < 400; ++i) {
    statistics.contribution[i] = is_seen(i) ? 0.5f : 0.05f;
    statistics.squared_error[i] = 1;
  }
  DensificationOptions options;
  options.num_to_add = 400;
  Foam after = before;
  const Rearrangement how = Densify(cells.delaunay, statistics, options, 1, 0, &after);
  int along = 0;
  for (size_t k = 0; k < after.NumSites(); ++k) {
    if (!how.is_new[k]) continue;
    const uint32_t parent = how.origin[k];
    Eigen::Vector3f farthest = Eigen::Vector3f::Zero(), farthest_seen = farthest;
    for (const uint32_t j : cells.delaunay.Neighbors(parent)) {
      if (j >= 400) continue;
      const Eigen::Vector3f offset = before.positions[j] - before.positions[parent];
      if (offset.norm() > farthest.norm()) farthest = offset;
      if (is_seen(j) && offset.norm() > farthest_seen.norm()) farthest_seen = offset;
    }
    const bool has_seen = farthest_seen.norm() > 0;
    along += has_seen && farthest_seen != farthest;
    const Eigen::Vector3f step = 0.25f * (has_seen ? farthest_seen : farthest);
    EXPECT_LT((after.positions[k] - before.positions[parent] - step).norm(), 0.11f * step.norm());
  }
  EXPECT_GT(along, 50) << "the two rules were the same, so nothing was tested";
}

// A child of sky between it and the other surfaces would hide all of the sky behind; and a cell of
// sky that no ray has met would be a hole in it.
TEST(Densification, SkyStaysFarAndOpaque) {
  constexpr int kInner = 200, kSky = 200;
  std::vector<Eigen::Vector3f> sites = RandomSites(kInner, 1);
  for (const Eigen::Vector3f& site : RandomSites(kSky, 2)) {
    sites.push_back(kSkyRadius * site.normalized());
  }
  const WalkableCells cells(sites);
  Foam foam = MarkedFoam(kInner + kSky);
  foam.positions = sites;
  DensificationStatistics statistics;
  statistics.Reset(kInner + kSky);
  // The inner cells are those that are seen, so that they would draw the children.
  std::fill_n(statistics.contribution.begin(), kInner, 0.5f);
  std::fill_n(statistics.squared_error.begin() + kInner, kSky, 1.f);
  DensificationOptions options;
  options.num_to_add = 100;
  const Rearrangement how = Densify(cells.delaunay, statistics, options, 1, 0, &foam);
  ASSERT_GT(how.num_added, 90u);
  for (size_t k = 0; k < foam.NumSites(); ++k) {
    if (how.origin[k] < kInner) continue;
    EXPECT_TRUE(IsSkySite(foam.positions[k])) << foam.positions[k].norm();
    EXPECT_EQ(foam.raw_density[k], how.origin[k]) << "made transparent";
  }
}

TEST(Densification, PrunesOnlySmallCellsThatNothingAroundSees) {
  const WalkableCells cells(RandomSites(400, 1));
  Foam foam = MarkedFoam(400);
  const Foam before = foam;
  DensificationStatistics statistics;
  statistics.Reset(400);
  for (int i = 0; i < 400; ++i) {
    if (foam.positions[i].x() > 0) statistics.contribution[i] = 1;
  }
  DensificationOptions options;
  options.prune_radius = 10;  // every cell counts as small
  Foam after = foam;
  const Rearrangement how = Densify(cells.delaunay, statistics, options, 1, 0, &after);
  EXPECT_GT(how.num_pruned, 50u);
  EXPECT_EQ(after.NumSites(), 400 - how.num_pruned);
  std::vector<bool> kept(400, false);
  for (const uint32_t origin : how.origin) kept[origin] = true;
  for (uint32_t i = 0; i < 400; ++i) {
    bool seen = statistics.contribution[i] > 0;
    for (const uint32_t j : cells.delaunay.Neighbors(i)) {
      seen |= j < 400 && statistics.contribution[j] > 0;
    }
    EXPECT_EQ(kept[i], seen) << i;
  }

  options.prune_radius = 0;  // no cell is small enough
  after = foam;
  EXPECT_EQ(Densify(cells.delaunay, statistics, options, 1, 0, &after).num_pruned, 0u);
  // What is unseen becomes transparent all the same.
  for (size_t k = 0; k < after.NumSites(); ++k) {
    EXPECT_LE(after.raw_density[k], after.positions[k].x() > 0 ? 400 : -1);
  }
}

TEST(Densification, DrawsInProportionToTheSquaredError) {
  const WalkableCells cells(RandomSites(300, 1));
  const Foam before = MarkedFoam(300);
  DensificationStatistics statistics;
  statistics.Reset(300);
  std::fill(statistics.contribution.begin(), statistics.contribution.end(), 0.5f);
  // Two cells with errors that make their scores 3 : 1, over many single draws.
  std::vector<uint32_t> inner;
  for (uint32_t i = 0; i < 300 && inner.size() < 2; ++i) {
    if (before.positions[i].norm() < 0.6f) inner.push_back(i);
  }
  statistics.squared_error[inner[0]] = 3;
  statistics.squared_error[inner[1]] = 1;
  DensificationOptions options;
  options.num_to_add = 1;
  int first = 0;
  const int draws = 400;
  for (int event = 0; event < draws; ++event) {
    Foam after = before;
    const Rearrangement how = Densify(cells.delaunay, statistics, options, 1, event, &after);
    ASSERT_EQ(how.num_added, 1u);
    for (size_t k = 0; k < how.origin.size(); ++k)
      first += how.is_new[k] && how.origin[k] == inner[0];
  }
  EXPECT_NEAR(first / double(draws), 0.75, 0.09);  // four standard deviations
}

TEST(Densification, KeepsWhatWasLearnedBetweenPlanAndDeed) {
  const WalkableCells cells(RandomSites(400, 1));
  const Foam before = MarkedFoam(400);
  DensificationStatistics statistics;
  statistics.Reset(400);
  std::fill(statistics.contribution.begin(), statistics.contribution.end(), 0.5f);
  std::fill(statistics.squared_error.begin(), statistics.squared_error.end(), 1.f);
  DensificationOptions options;
  options.num_to_add = 50;
  const Rearrangement plan = PlanDensification(cells.delaunay, statistics, options, 1, 0, before);
  Foam now = before;
  for (Eigen::Vector3f& p : now.positions) p += Eigen::Vector3f(0.01f, 0.02f, 0.03f);
  for (float& raw : now.raw_density) raw += 0.5f;
  for (float& value : now.sh) value += 0.5f;
  for (float& value : now.identity) value += 0.5f;
  Foam after = now;
  Rearrange(plan, statistics, options, &after);
  ASSERT_EQ(after.NumSites(), 450u);
  ExpectParametersFollow(now, after, plan);
  for (size_t k = 0; k < after.NumSites(); ++k) {
    if (plan.is_new[k]) {
      ASSERT_EQ(after.positions[k], plan.positions[k]);
    } else {
      ASSERT_NE(after.positions[k], plan.positions[k]);
    }
  }
}

}  // namespace
}  // namespace semfoam
