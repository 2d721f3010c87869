// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/coarse_views.h"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

TEST(FarthestVisible, KeepsOffTheOutlineOfWhatIsNearer) {
  // Something at 2 before a wall at 3, and nothing in the last column.
  const float inf = std::numeric_limits<float>::infinity();
  const std::vector<float> distance = {2,
                                       2,
                                       3,
                                       3,
                                       3,
                                       inf,  //
                                       2,
                                       2,
                                       3,
                                       3,
                                       3,
                                       inf};
  const CoarseDistances view = {6, 2, distance};
  const auto off_outlines = [&](int x) { return FarthestVisible(view, x, 0, true); };
  EXPECT_EQ(off_outlines(0), 2);
  EXPECT_EQ(off_outlines(1), 2);
  EXPECT_EQ(off_outlines(2), 2);
  EXPECT_EQ(off_outlines(3), 3);
  EXPECT_EQ(off_outlines(4), 3);
  EXPECT_EQ(off_outlines(5), 3);
  EXPECT_EQ(FarthestVisible(view, 1, 1, false), 3);
  EXPECT_EQ(FarthestVisible(view, 2, 1, false), 3);
  EXPECT_EQ(FarthestVisible(view, 4, 1, false), inf);
}

TEST(FarthestVisible, TakesTheFarthestOnASlope) {
  const std::vector<float> distance = {2, 2.04f, 2.08f, 2.12f};
  EXPECT_EQ(FarthestVisible({4, 1, distance}, 1, 0, true), 2.08f);
}

}  // namespace
}  // namespace semfoam
