// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/geometry/site_tree.h"

#include <algorithm>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

TEST(SiteTree, FindsWhatASearchOfAllFinds) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> coordinate(-1, 1);
  std::vector<Eigen::Vector3f> positions;
  for (int i = 0; i < 2000; ++i) {
    const float x = coordinate(random), y = coordinate(random), z = coordinate(random);
    // Half of them on a coarse lattice, for many equal distances, some at the same place.
    positions.emplace_back(x, y, z);
    if (i % 2 == 0) positions.back() = (4 * positions.back()).array().round() / 4;
  }
  // Without every third.
  std::vector<uint32_t> sites;
  for (uint32_t i = 0; i < positions.size(); ++i) {
    if (i % 3 != 0) sites.push_back(i);
  }
  const SiteTree tree(positions, sites);
  for (int k = 0; k < 300; ++k) {
    const double x = coordinate(random), y = coordinate(random), z = coordinate(random);
    Eigen::Vector3d query(x, y, z);
    if (k % 3 == 0) query = (4 * query).array().round() / 4;
    const double reach = k % 2 == 0 ? 0.25 : 10;
    std::vector<uint32_t> expected;
    const auto distance = [&](uint32_t site) {
      return (positions[site].cast<double>() - query).squaredNorm();
    };
    for (const uint32_t site : sites) {
      if (distance(site) <= reach * reach) expected.push_back(site);
    }
    std::stable_sort(expected.begin(), expected.end(), [&](uint32_t a, uint32_t b) {
      return distance(a) < distance(b);
    });
    expected.resize(std::min<size_t>(expected.size(), 5));
    EXPECT_EQ(tree.Nearest(query, reach, 5), expected);
  }
}

TEST(SiteTree, IsEmptyWithoutSites) {
  const std::vector<Eigen::Vector3f> positions(3, Eigen::Vector3f::Zero());
  EXPECT_TRUE(SiteTree(positions, {}).Nearest({0, 0, 0}, 1, 4).empty());
  EXPECT_TRUE(SiteTree(positions, {1}).Nearest({0, 0, 0}, 1, 0).empty());
}

}  // namespace
}  // namespace semfoam
