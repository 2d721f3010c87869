// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/reference_positions.h"

#include "foam/util/error.h"

#include "tests/plugin/test_util.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(ReferencePositions, ReadsWhatColmapTakesAndTablesWithCommas) {
  const TempFolder temp;
  const auto path = temp / "positions.txt";
  WriteFile(path, "# by hand\n\na.jpg 1 -2.5 3e2\r\nleft/b c.jpg\t4 5 6\nd.jpg,7,8,9");
  const std::vector<ImagePosition> positions = ReadReferencePositions(path, false);
  ASSERT_EQ(positions.size(), 3u);
  EXPECT_EQ(positions[0].image, "a.jpg");
  EXPECT_EQ(positions[0].position, Eigen::Vector3d(1, -2.5, 300));
  EXPECT_EQ(positions[1].image, "left/b c.jpg");
  EXPECT_EQ(positions[2].position, Eigen::Vector3d(7, 8, 9));
}

TEST(ReferencePositions, AnythingElseIsOneSentence) {
  const TempFolder temp;
  const auto path = temp / "positions.txt";
  const struct {
    const char* text;
    bool is_gps;
    const char* says;
  } cases[] = {{"", false, "has no camera position"},
               {"# none\n", false, "has no camera position"},
               {"a.jpg 1 2\n", false, "line 1 is 'a.jpg 1 2'; it must be the name"},
               {"1 2 3\n", false, "line 1 is '1 2 3'"},
               {"a.jpg 1 2 3\nb.jpg 1 2 x\n", false, "line 2 is 'b.jpg 1 2 x'"},
               {"a.jpg 1 2 nan\n", false, "line 1 is"},
               {"a.jpg 1 2 3\na.jpg 1 2 3\n", false, "a second position of 'a.jpg'"},
               {"a.jpg 91 2 3\n", true, "latitude, longitude and altitude"}};
  for (const auto& [text, is_gps, says] : cases) {
    WriteFile(path, text);
    try {
      ReadReferencePositions(path, is_gps);
      ADD_FAILURE() << text;
    } catch (const UserError& error) {
      EXPECT_THAT(error.what(), StartsWith(path.string() + ": "));
      EXPECT_THAT(error.what(), HasSubstr(says));
    }
  }
  EXPECT_THROW(ReadReferencePositions(temp / "none.txt", false), UserError);
}

TEST(ReferencePositions, DegreesBecomeMetresEastNorthUp) {
  const Eigen::Vector3d origin(48, 11, 500);
  EXPECT_LT(EastNorthUp(origin, origin).norm(), 1e-9);
  EXPECT_LT((EastNorthUp({48, 11, 510}, origin) - Eigen::Vector3d(0, 0, 10)).norm(), 1e-6);
  // A minute of latitude there is 1853.2 m on the ellipsoid, of longitude 1243.0 m, 500 m up.
  const Eigen::Vector3d north = EastNorthUp({48 + 1.0 / 60, 11, 500}, origin);
  EXPECT_NEAR(north.y(), 1853.4, 0.5);
  EXPECT_NEAR(north.x(), 0, 1e-6);
  const Eigen::Vector3d east = EastNorthUp({48, 11 + 1.0 / 60, 500}, origin);
  EXPECT_NEAR(east.x(), 1243.5, 0.7);
  EXPECT_NEAR(east.z(), 0, 0.2);

  const TempFolder temp;
  WriteFile(temp / "gps.txt", "a.jpg 48 11 500\nb.jpg 48 11 510\n");
  const std::vector<ImagePosition> positions = ReadReferencePositions(temp / "gps.txt", true);
  EXPECT_EQ(positions[0].position.norm(), 0);
  EXPECT_NEAR(positions[1].position.z(), 10, 1e-6);
}

}  // namespace
}  // namespace semfoam
