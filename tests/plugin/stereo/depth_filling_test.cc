// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/depth_filling.h"

#include <cmath>
#include <cstddef>
#include <limits>

#include "tests/plugin/stereo/plain_views.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::Each;

double Plane(int x, int y) { return 0.4 + 2e-3 * x - 1e-3 * y; }

bool IsInHole(int x, int y) { return std::abs(x - 30) <= 10 && std::abs(y - 20) <= 8; }

double PlaneWithHole(int x, int y) { return IsInHole(x, y) ? 0 : Plane(x, y); }

TEST(FillDepths, ContinuesAPlaneAcrossAHole) {
  const DepthMap filled = FillDepths(ViewOf(Grey), MapOf(PlaneWithHole));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      EXPECT_NEAR(At(filled, x, y), Plane(x, y), (IsInHole(x, y) ? 1e-3 : 1e-7) * Plane(x, y));
    }
  }
}

TEST(FillDepths, KeepsWhatIsKnown) {
  const DepthMap known = MapOf([](int x, int y) { return (x + y) % 3 == 0 ? Plane(x, y) : 0; });
  const DepthMap filled = FillDepths(ViewOf(Grey), known);
  for (size_t i = 0; i < known.inverse.size(); ++i) {
    if (known.inverse[i] > 0) {
      EXPECT_EQ(filled.inverse[i], known.inverse[i]);
    }
  }
}

TEST(FillDepths, DoesNotGoBeyondWhatIsKnown) {
  const DepthMap filled =
      FillDepths(ViewOf(Grey), MapOf([](int x, int y) { return x < 20 ? Plane(x, y) : 0; }));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 35; x < kWidth; ++x) EXPECT_EQ(At(filled, x, y), 0) << x << " " << y;
  }
}

TEST(FillDepths, DoesNotBridgeTwoDepths) {
  // A thing before a background, both of one colour: nothing tells which of them the gap is.
  const DepthMap filled = FillDepths(ViewOf(Grey), MapOf([](int x, int) {
                                       return x < 25 ? 0.8 : x < 35 ? 0 : 0.4;
                                     }));
  for (int y = 0; y < kHeight; ++y) EXPECT_EQ(At(filled, 30, y), 0) << y;
}

TEST(FillDepths, StopsWhereTheColorChanges) {
  // The same, but in two colours: the gap is of the background's.
  const StereoView view = ViewOf([](int x, int) { return x < 25 ? 0.1f : 0.9f; });
  const auto is_in_gap = [](int x, int y) { return x >= 25 && x < 31 && std::abs(y - 20) <= 4; };
  const DepthMap filled = FillDepths(view, MapOf([&](int x, int y) {
                                       if (x < 25) return 0.8;
                                       return is_in_gap(x, y) ? 0 : 0.4;
                                     }));
  for (int y = 16; y <= 24; ++y) {
    for (int x = 25; x < 31; ++x) EXPECT_NEAR(At(filled, x, y), 0.4, 4e-3) << x << " " << y;
  }
}

TEST(FillDepths, IsUnknownWhereNothingIsKnownOrSeen) {
  EXPECT_THAT(FillDepths(ViewOf(Grey), MapOf([](int, int) { return 0; })).inverse, Each(0.f));
  // One pixel is no plane.
  const DepthMap one = MapOf([](int x, int y) { return x == 30 && y == 20 ? 0.5 : 0; });
  EXPECT_EQ(FillDepths(ViewOf(Grey), one).inverse, one.inverse);
  StereoView view = ViewOf(Grey);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (!IsInHole(x, y)) continue;
      view.grey[static_cast<size_t>(y) * kWidth + x] = std::numeric_limits<float>::quiet_NaN();
    }
  }
  const DepthMap known = MapOf(PlaneWithHole);
  EXPECT_EQ(FillDepths(view, known).inverse, known.inverse);
}

}  // namespace
}  // namespace semfoam
