// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/stereo/plane_filling.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <limits>

#include "tests/plugin/stereo/plain_views.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::Each;

// A plain wall above a plain table, in two greys, that meet at kCorner, with a print on each.
constexpr int kCorner = 20;
constexpr float kWallGrey = 0.6f, kTableGrey = 0.4f;

bool IsOnWall(int, int y) { return y < kCorner; }
double Wall(int x, int) { return 0.4 + 1e-3 * x; }
// The same as the wall's at the corner, and nearer below.
double Table(int x, int y) { return Wall(x, y) + 8e-3 * (y - (kCorner - 0.5)); }
double Truth(int x, int y) { return IsOnWall(x, y) ? Wall(x, y) : Table(x, y); }

bool IsOnPrint(int x, int y) {
  return (x >= 10 && x < 22 && y >= 4 && y < 14) || (x >= 30 && x < 48 && y >= 25 && y < 36);
}
float Scene(int x, int y) {
  if (IsOnPrint(x, y)) return (x / 3 + y / 3) % 2 == 0 ? 0.9f : 0.1f;
  return IsOnWall(x, y) ? kWallGrey : kTableGrey;
}
// Matching knows the prints, and two pixels of what is plain around them.
bool IsKnown(int x, int y) {
  for (int b = -2; b <= 2; ++b) {
    for (int a = -2; a <= 2; ++a) {
      if (IsOnPrint(x + a, y + b)) return true;
    }
  }
  return false;
}
double Known(int x, int y) { return IsKnown(x, y) ? Truth(x, y) : 0; }

// Expects depths of the truth, and many of them.
void ExpectTruth(const DepthMap& filled) {
  int count = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      if (At(filled, x, y) == 0) continue;
      ++count;
      EXPECT_NEAR(At(filled, x, y), Truth(x, y), 0.01 * Truth(x, y)) << x << " " << y;
    }
  }
  EXPECT_GT(count, 0.8 * kWidth * kHeight);
}

TEST(FillPlanes, ContinuesEachPlaneUpToTheCorner) {
  ExpectTruth(FillPlanes(ViewOf(Scene), MapOf(Known)));
}

TEST(FillPlanes, PassesOverNoise) {
  // Noise of 2 % adds up, from pixel to pixel, to more than the edge of a thing.
  const auto noisy = [](int x, int y) {
    return Scene(x, y) + 0.02f * static_cast<float>((x * 7 + y * 13) % 11) / 10;
  };
  ExpectTruth(FillPlanes(ViewOf(noisy), MapOf(Known)));
}

TEST(FillPlanes, KeepsWhatIsKnown) {
  const DepthMap known = MapOf(Known);
  const DepthMap filled = FillPlanes(ViewOf(Scene), known);
  for (size_t i = 0; i < known.inverse.size(); ++i) {
    if (known.inverse[i] > 0) {
      EXPECT_EQ(filled.inverse[i], known.inverse[i]);
    }
  }
}

TEST(FillPlanes, DoesNotReachAnotherColor) {
  // A plain thing without a known depth stands on the table.
  const auto is_thing = [](int x, int y) { return x >= 8 && x < 22 && y >= 18 && y < 34; };
  const StereoView view =
      ViewOf([&](int x, int y) { return is_thing(x, y) ? 0.95f : Scene(x, y); });
  const DepthMap filled = FillPlanes(view, MapOf(Known));
  for (int y = 18; y < 34; ++y) {
    for (int x = 8; x < 22; ++x) EXPECT_EQ(At(filled, x, y), 0) << x << " " << y;
  }
  EXPECT_GT(At(filled, 25, 30), 0);
}

TEST(FillPlanes, DoesNotGoOnWhereLightIsCutOff) {
  const auto color = [](int x, int y) {
    return IsOnWall(x, y) && !IsOnPrint(x, y) ? 1.f : Scene(x, y);
  };
  const DepthMap filled = FillPlanes(ViewOf(color), MapOf(Known));
  EXPECT_EQ(At(filled, 30, 8), 0);
  EXPECT_GT(At(filled, 20, 30), 0);
  EXPECT_GT(At(FillPlanes(ViewOf(Scene), MapOf(Known)), 30, 8), 0);
}

TEST(FillPlanes, IsUnknownWhereVotesDisagree) {
  // A thing of the table's colour is known, and on no plane.
  const auto is_thing = [](int x, int y) { return x < 6 && y >= kCorner; };
  const DepthMap known = MapOf(
      [&](int x, int y) { return is_thing(x, y) ? 1 + 0.1 * ((x * 5 + y * 3) % 7) : Known(x, y); });
  const DepthMap with = FillPlanes(ViewOf(Scene), known);
  const DepthMap without = FillPlanes(ViewOf(Scene), MapOf(Known));
  for (int y = 26; y < 36; ++y) {
    EXPECT_EQ(At(with, 8, y), 0) << y;
    EXPECT_GT(At(without, 8, y), 0) << y;
  }
}

TEST(FillPlanes, DoesNotGoOnFromALine) {
  // A thing with texture before a plain background, two pixels of which matching takes for it.
  const auto is_thing = [](int x, int, int beside) { return x < 20 + beside; };
  const StereoView view = ViewOf([&](int x, int y) {
    return !is_thing(x, y, 0) ? 0.5f : (x / 3 + y / 3) % 2 == 0 ? 0.9f : 0.1f;
  });
  const DepthMap filled =
      FillPlanes(view, MapOf([&](int x, int y) { return is_thing(x, y, 2) ? Wall(x, y) : 0; }));
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 30; x < kWidth; ++x) EXPECT_EQ(At(filled, x, y), 0) << x << " " << y;
  }
}

TEST(FillPlanes, NeedsAPlaneOfSomeSize) {
  const StereoView view = ViewOf(Grey);
  EXPECT_THAT(FillPlanes(view, MapOf([](int, int) { return 0; })).inverse, Each(0.f));
  // Pixels on a line, a border, and fewer pixels than make a plane.
  const DepthMap line = MapOf([](int x, int y) { return y == 20 ? Wall(x, y) : 0; });
  EXPECT_EQ(FillPlanes(view, line).inverse, line.inverse);
  const DepthMap border = MapOf([](int x, int y) {
    const int outside = std::max(std::abs(x - 30), std::abs(y - 20));
    return outside == 12 || outside == 13 ? Wall(x, y) : 0;
  });
  EXPECT_EQ(FillPlanes(view, border).inverse, border.inverse);
  const DepthMap few =
      MapOf([](int x, int y) { return x >= 30 && x < 34 && y >= 20 && y < 24 ? Wall(x, y) : 0; });
  EXPECT_EQ(FillPlanes(view, few).inverse, few.inverse);
}

TEST(FillPlanes, IsUnknownWhereThePhotoShowsNothing) {
  StereoView view = ViewOf(Scene);
  view.grey[5] = std::numeric_limits<float>::quiet_NaN();
  const DepthMap filled = FillPlanes(view, MapOf(Known));
  EXPECT_EQ(filled.inverse[5], 0);
  EXPECT_GT(filled.inverse[7], 0);
}

TEST(FillPlanes, IsTheSameTwice) {
  const StereoView view = ViewOf(Scene);
  EXPECT_EQ(FillPlanes(view, MapOf(Known)).inverse, FillPlanes(view, MapOf(Known)).inverse);
}

}  // namespace
}  // namespace semfoam
