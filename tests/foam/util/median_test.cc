// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/median.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

namespace semfoam {
namespace {

TEST(Median, IsTheMiddleOneInAnyOrder) {
  std::vector<int> values = {1, 2, 2, 7, 9};
  do {
    EXPECT_EQ(Median(values), 2);
  } while (std::next_permutation(values.begin(), values.end()));
  EXPECT_EQ(Median(std::vector<float>{0.5f}), 0.5f);
}

TEST(Median, OfAnEvenNumberIsTheHigherOfTheTwoInTheMiddle) {
  EXPECT_EQ(Median(std::vector<double>{4, 1, 3, 2}), 3);
  EXPECT_EQ(Median(std::vector<double>{-1, -2}), -1);
}

TEST(Median, AsksForAValue) { EXPECT_DEATH(Median(std::vector<double>()), "empty"); }

}  // namespace
}  // namespace semfoam
