// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>

#include "gtest/gtest.h"

namespace semfoam {

// How the foam stores what it computes: as float, neighbour by neighbour.
void StoreAndLoad(const double* in, double* out) {
  const float first = in[0];
  const float second = in[1];
  out[0] = static_cast<double>(first);
  out[1] = static_cast<double>(second);
}

namespace {

// Read at each call, so that the compiler can neither inline the function nor compute it ahead.
void (*volatile store_and_load)(const double*, double*) = StoreAndLoad;

// GCC 12's vectoriser of straight-line code leaves these roundings out unless it is told not to run
// (SEMFOAM_ROUNDING_FLAGS); then training's bytes depend on the level of optimisation.
TEST(Rounding, IsKeptWhereTwoNumbersStandSideBySide) {
  const std::array<double, 2> in = {0.1, 0.2};
  std::array<double, 2> out = {};
  store_and_load(in.data(), out.data());
  EXPECT_EQ(out[0], 0x1.99999ap-4);
  EXPECT_EQ(out[1], 0x1.99999ap-3);
}

}  // namespace
}  // namespace semfoam
