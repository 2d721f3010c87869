// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/block_sites.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Sites at x = 0, 1, ..., 9; the block is from 2 to 5, with its halo.
class BlockSites : public testing::Test {
 protected:
  BlockSites() {
    for (int x = 0; x < 10; ++x) positions_.emplace_back(static_cast<float>(x), 0.f, 0.f);
    padded_.low[0] = 2;
    padded_.high[0] = 5;
  }

  // The positions of the sites along the axis, in their order.
  std::vector<float> Places(const StartSites& sites) const {
    std::vector<float> places;
    size_t next = 0;
    for (size_t k = 0; k < sites.origin.size(); ++k) {
      places.push_back(sites.is_new[k] ? sites.points[next++].position[0]
                                       : positions_[sites.origin[k]][0]);
    }
    EXPECT_EQ(next, sites.points.size());
    return places;
  }

  static std::vector<SeedPoint> SeedsAt(const std::vector<float>& places) {
    std::vector<SeedPoint> seeds;
    for (const float x : places) {
      seeds.push_back({{x, 0, 0}, Eigen::Vector3f::Constant(0.25f), /*is_dense=*/true});
    }
    return seeds;
  }

  std::vector<Eigen::Vector3f> positions_;
  BlockBox padded_;
  // The rays of the block meet what is at 5 and 8.
  std::vector<uint8_t> is_met_ = {0, 0, 0, 0, 0, 1, 0, 0, 1, 0};
};

TEST_F(BlockSites, AreThoseInTheBoxAndFrozenOnesThatRaysMeet) {
  const StartSites sites = ChooseStartSites(positions_, padded_, is_met_);
  EXPECT_THAT(sites.origin, ElementsAre(2, 3, 4, 5, 8));
  EXPECT_THAT(sites.is_frozen, ElementsAre(0, 0, 0, 1, 1));
  EXPECT_THAT(sites.is_new, ElementsAre(0, 0, 0, 0, 0));
  EXPECT_EQ(sites.NumFrozen(), 2u);
  EXPECT_THAT(sites.points, IsEmpty());
}

TEST_F(BlockSites, NewOnesFollowTheNearestThatIsTrained) {
  StartSites sites = ChooseStartSites(positions_, padded_, is_met_);
  // 4.9 is nearer to 5, which is frozen; 1.5 and 5.5 are outside.
  AddSitesAtSeeds(SeedsAt({4.9f, 2.3f, 1.5f, 3.6f, 5.5f}), positions_, padded_, 6, &sites);
  EXPECT_THAT(sites.origin, ElementsAre(2, 2, 3, 4, 4, 4, 5, 8));
  EXPECT_THAT(sites.is_new, ElementsAre(0, 1, 0, 0, 1, 1, 0, 0));
  EXPECT_THAT(sites.is_frozen, ElementsAre(0, 0, 0, 0, 0, 0, 1, 1));
  EXPECT_THAT(Places(sites), ElementsAre(2, 2.3f, 3, 4, 4.9f, 3.6f, 5, 8));
  EXPECT_EQ(sites.points[0].color[0], 0.25f);
}

TEST_F(BlockSites, NewOnesAreThinnedToWhatIsMissing) {
  std::vector<float> places;
  for (int i = 0; i < 300; ++i) places.push_back(2 + 0.01f * static_cast<float>(i));
  StartSites sites = ChooseStartSites(positions_, padded_, is_met_);
  AddSitesAtSeeds(SeedsAt(places), positions_, padded_, 23, &sites);
  EXPECT_LE(sites.points.size(), 20u);
  EXPECT_GE(sites.points.size(), 10u);
}

TEST_F(BlockSites, NoneIsAddedWhereThereAreEnoughOrNoneIsTrained) {
  StartSites sites = ChooseStartSites(positions_, padded_, is_met_);
  AddSitesAtSeeds(SeedsAt({2.5f}), positions_, padded_, 3, &sites);
  EXPECT_EQ(sites.origin.size(), 5u);
  BlockBox empty = padded_;
  empty.low[0] = 4.5f;
  sites = ChooseStartSites(positions_, empty, is_met_);
  EXPECT_EQ(sites.NumFrozen(), sites.origin.size());
  AddSitesAtSeeds(SeedsAt({4.7f}), positions_, empty, 10, &sites);
  EXPECT_THAT(sites.points, IsEmpty());
}

}  // namespace
}  // namespace semfoam
