// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/ply_mesh.h"

#include "tests/plugin/test_util.h"
#include "tests/small_files.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::ElementsAre;

class PlyMeshTest : public testing::Test {
 protected:
  PolygonSoup Read(const std::string& bytes) const {
    WriteFile(folder_ / "a.ply", bytes);
    return ReadPlyMesh(folder_ / "a.ply");
  }

  TempFolder folder_;
};

TEST_F(PlyMeshTest, ReadsTextAndBytesInEitherOrder) {
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    SCOPED_TRACE(format);
    const PolygonSoup mesh = Read(SmallPlyMesh(format));
    EXPECT_THAT(
        mesh.vertices,
        ElementsAre(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0)));
    EXPECT_THAT(mesh.faces, ElementsAre(ElementsAre(0, 1, 2)));
  }
}

// Lists where nobody expects them, other elements before, between and after, polygons of any number
// of corners, the other names of things, lines that end as on Windows, and doubles to the last bit.
TEST_F(PlyMeshTest, ReadsOverWhatIsOfNoUse) {
  const PolygonSoup mesh = Read(
      "ply\r\nformat ascii 1.0\r\ncomment a comment\r\nelement camera 2\r\nproperty list uchar "
      "float view\r\nelement empty 1000000000000\r\nelement vertex 3\r\nproperty uchar red\r\n"
      "property double z\r\nproperty list uchar int near\r\nproperty double y\r\nproperty int x\r\n"
      "element face 3\r\nproperty float quality\r\nproperty list uchar uint vertex_index\r\n"
      "property list ushort short texture\r\nelement edge 1\r\nproperty int of\r\nend_header\r\n"
      "2 0.5 1e-3\r\n0\r\n"
      "255 0.1 0 0.30000000000000004 1\r\n1 +2 3 7 8 9 -4 5\r\n1 1 1 2 6 -7\r\n"
      "0.5 4 0 1 2 1 0\r\n0.25 0 1 9\r\n1 2 2 0 0\r\n77\r\nand more\r\n");
  EXPECT_THAT(mesh.vertices,
              ElementsAre(Eigen::Vector3d(1, 0.30000000000000004, 0.1),
                          Eigen::Vector3d(5, -4, 2),
                          Eigen::Vector3d(-7, 6, 1)));
  EXPECT_THAT(mesh.faces, ElementsAre(ElementsAre(0, 1, 2, 1), ElementsAre(2, 0)));
}

TEST_F(PlyMeshTest, PointsNeedNoFaces) {
  const PolygonSoup mesh = Read(
      "ply\nformat ascii 1.0\nelement vertices 1\nproperty float x\nproperty float y\nproperty "
      "float z\nend_header\n1 2 3");
  EXPECT_THAT(mesh.vertices, ElementsAre(Eigen::Vector3d(1, 2, 3)));
  EXPECT_TRUE(mesh.faces.empty());
}

}  // namespace
}  // namespace semfoam
