// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/colmap/seed_cloud.h"

#include "foam/geometry/guard_sites.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/plugin/test_util.h"
#include "tests/small_files.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::ElementsAre;

MATCHER_P2(IsPoint, position, color, "") {
  return (arg.position - position).norm() < 1e-6f && (arg.color - color).norm() < 1e-3f &&
         arg.is_dense;
}

Eigen::Vector3f V(float x, float y, float z) { return {x, y, z}; }

class SeedCloudTest : public testing::Test {
 protected:
  // By x, then y.
  SeedCloud Read(const std::string& bytes, const Similarity& frame = {}, size_t most = 1000) const {
    WriteFile(folder_ / "a.ply", bytes);
    SeedCloud cloud = ReadSeedCloud(folder_ / "a.ply", frame, most);
    std::sort(cloud.points.begin(), cloud.points.end(), [](const SeedPoint& a, const SeedPoint& b) {
      return std::pair(a.position.x(), a.position.y()) < std::pair(b.position.x(), b.position.y());
    });
    return cloud;
  }

  TempFolder folder_;
};

TEST_F(SeedCloudTest, ReadsTextAndBytesInEitherOrderAndReadsOverLists) {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    for (const char* number : {"float", "double"}) {
      SCOPED_TRACE(std::string(format) + " " + number);
      const SeedCloud cloud = Read(SmallCloud(format, number));
      EXPECT_EQ(cloud.num_points, 3);
      EXPECT_EQ(cloud.num_far + cloud.num_not_finite, 0);
      EXPECT_TRUE(cloud.has_colors);
      EXPECT_THAT(cloud.points,
                  ElementsAre(IsPoint(V(0, 0, 0), V(1, 0, 0)),
                              IsPoint(V(0, 1, -0.5f), V(0, 0, 1)),
                              IsPoint(V(1, 0, 0.25f), V(0, 1, 0))));
    }
  }
}

TEST_F(SeedCloudTest, ConvertsToTheNormalizedFrame) {
  const Similarity frame{4, {-1, 2, 3}};
  EXPECT_THAT(Read(SmallCloud("binary_little_endian"), frame).points,
              ElementsAre(IsPoint(V(0.25f, -0.5f, -0.75f), V(1, 0, 0)),
                          IsPoint(V(0.25f, -0.25f, -0.875f), V(0, 0, 1)),
                          IsPoint(V(0.5f, -0.5f, -0.6875f), V(0, 1, 0))));
  // Coordinates of a map, of which floats know half a metre.
  const std::string far =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double y\nproperty "
      "double z\nend_header\n4500000.125 5400000.25 300.5\n";
  EXPECT_THAT(Read(far, {2, {4500000, 5400000, 300}}).points,
              ElementsAre(IsPoint(V(0.0625f, 0.125f, 0.25f), V(0.5f, 0.5f, 0.5f))));
}

// In any order of properties, of other types and names, in 0..1, and without.
TEST_F(SeedCloudTest, ReadsColorsOfAnyProgram) {
  const auto cloud = [](const std::string& type, const std::string& prefix, const char* values) {
    const std::string property = "property " + type + " " + prefix;
    return "ply\r\nformat ascii 1.0\r\nelement camera 1\r\nproperty float x\r\nelement vertex "
           "1\r\n" +
           property + "blue\r\n" + property + "green\r\n" + property +
           "red\r\nproperty float z\r\nproperty float nx\r\nproperty float y\r\nproperty float "
           "x\r\nend_header\r\n77\r\n" +
           values + " 3 9 2 1\r\n";
  };
  const auto position = V(1, 2, 3);
  EXPECT_THAT(Read(cloud("uchar", "", "51 102 255")).points,
              ElementsAre(IsPoint(position, V(1, 0.4f, 0.2f))));
  EXPECT_THAT(Read(cloud("uint8", "diffuse_", "51 102 255")).points,
              ElementsAre(IsPoint(position, V(1, 0.4f, 0.2f))));
  EXPECT_THAT(Read(cloud("ushort", "", "13107 0 65535")).points,
              ElementsAre(IsPoint(position, V(1, 0, 0.2f))));
  EXPECT_THAT(Read(cloud("float", "", "0.25 nan 1.5")).points,
              ElementsAre(IsPoint(position, V(1, 0.5f, 0.25f))));
  const SeedCloud grey = Read(cloud("uchar", "ambient_", "1 2 3"));
  EXPECT_FALSE(grey.has_colors);
  EXPECT_THAT(grey.points, ElementsAre(IsPoint(position, V(0.5f, 0.5f, 0.5f))));
}

TEST_F(SeedCloudTest, LeavesOutWhatIsFarOrNotFinite) {
  const SeedCloud cloud = Read(
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty "
      "float z\nend_header\n1 0 0\nnan 0 0\n0 inf 0\n31 0 0\n0 0 -1e30\n");
  EXPECT_EQ(cloud.num_points, 5);
  EXPECT_EQ(cloud.num_not_finite, 2);
  EXPECT_EQ(cloud.num_far, 2);
  EXPECT_THAT(cloud.points, ElementsAre(IsPoint(V(1, 0, 0), V(0.5f, 0.5f, 0.5f))));
}

// Longer than the reader's buffer, of records that no power of two is a multiple of.
TEST_F(SeedCloudTest, ReadsManyPoints) {
  constexpr int kPoints = 40'000;
  for (const bool is_text : {true, false}) {
    SCOPED_TRACE(is_text ? "text" : "bytes");
    std::string ply = std::string("ply\nformat ") + (is_text ? "ascii" : "binary_little_endian") +
                      " 1.0\nelement vertex " + std::to_string(kPoints) +
                      "\nproperty float x\nproperty double y\nproperty float z\nproperty uchar "
                      "red\nproperty uchar green\nproperty uchar blue\nend_header\n";
    for (int i = 0; i < kPoints; ++i) {
      const auto x = static_cast<float>(i) / kPoints;
      if (is_text) {
        ply += std::to_string(x) + " " + std::to_string(2. * x) + "\t-1  1 2 3\n";
        continue;
      }
      AppendBinary(x, &ply);
      AppendBinary(2. * x, &ply);
      AppendBinary(-1.f, &ply);
      ply += "\1\2\3";
    }
    const SeedCloud cloud = Read(ply, {}, 100'000);
    EXPECT_EQ(cloud.num_points, kPoints);
    ASSERT_EQ(cloud.points.size(), static_cast<size_t>(kPoints));
    for (int i = 0; i < kPoints; ++i) {
      const auto x = static_cast<float>(i) / kPoints;
      ASSERT_LT((cloud.points[i].position - V(x, 2 * x, -1)).norm(), 2e-6f) << i;
      ASSERT_LT((255 * cloud.points[i].color - V(1, 2, 3)).norm(), 1e-3f) << i;
    }
    EXPECT_LE(Read(ply, {}, 100).points.size(), 100u);
  }
}

}  // namespace
}  // namespace semfoam
