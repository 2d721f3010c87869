// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/cell_labels.h"

#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/model/activation.h"

#include <algorithm>
#include <vector>

#include "tests/foam/random_cells.h"
#include <gtest/gtest.h>

namespace semfoam {
namespace {

// Volumes and meshes are of matter.
TEST(CellLabels, SkyIsNoMatter) {
  constexpr int kInner = 50, kSky = 50;
  Foam foam;
  foam.sh_degree = 0;
  foam.positions = RandomSites(kInner, 1);
  for (const Eigen::Vector3f& site : RandomSites(kSky, 2)) {
    foam.positions.push_back(kSkyRadius * site.normalized());
  }
  foam.raw_density.assign(kInner + kSky, static_cast<float>(RawDensity(20)));
  foam.sh.assign((kInner + kSky) * foam.ShStride(), 0.f);
  const CellLabels labels = LabelCells(foam, Triangulate(WithGuardSites(foam.positions)));
  const auto middle = labels.solid.begin() + kInner;
  EXPECT_EQ(std::count(labels.solid.begin(), middle, 1), kInner);
  EXPECT_EQ(std::count(middle, labels.solid.end(), 1), 0);
}

}  // namespace
}  // namespace semfoam
