// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/ply_split.h"

#include <algorithm>
#include <fstream>

#include "tests/export/test_foams.h"
#include "tests/export/transfer/test_meshes.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

std::string ReadAll(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class PlySplitTest : public TemporaryFolderTest {
 protected:
  std::vector<WrittenFile> Split(const std::string& bytes) {
    std::ofstream(folder_ / "in.ply", std::ios::binary) << bytes;
    return SplitLabelledPly(
        folder_ / "in.ply", folder_, {{LabelId{7}, MaskId{7}, "mug"}, {LabelId{8}, MaskId{8}, ""}});
  }
};

constexpr char kHeader[] =
    "ply\nformat ascii 1.0\ncomment by hand\nelement vertex %V\nproperty float x\nproperty float "
    "y\n"
    "property float z\nproperty int label\nelement camera %C\nproperty int of\nelement face %F\n"
    "property uchar shade\nproperty list uchar int vertex_indices\nproperty list uchar float uv\n"
    "property int label\nend_header\n";

std::string Header(int vertices, int faces, bool has_camera) {
  std::string header = kHeader;
  const auto put = [&](const std::string& what, const std::string& with) {
    header.replace(header.find(what), what.size(), with);
  };
  if (!has_camera) put("element camera %C\nproperty int of\n", "");
  if (has_camera) put("%C", "1");
  put("%V", std::to_string(vertices));
  put("%F", std::to_string(faces));
  return header;
}

// Vertices on the border are in both files, the order stays, and so does all that faces carry.
TEST_F(PlySplitTest, EachObjectIsAFile) {
  const std::vector<WrittenFile> files =
      Split(Header(6, 4, true) +
            "0 0 0 7\n1.50 0 0 7\n1 1 0 8\n0 1 0 7\n2 2 2 8\n9 9 9 0\n5\n"
            "10 3 0 1 2 2 0.5 1 7\n11 4 3 0 2 1 0 7\n12 3 4 2 1 1 0.25 8\n13 3 5 4 2 0 0\n");
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].path, "objects/7_mug.ply");
  EXPECT_EQ(files[1].path, "objects/8_label_8.ply");
  EXPECT_EQ(files[1].summary, "3 vertices, 1 faces");
  EXPECT_EQ(ReadAll(folder_ / files[0].path),
            Header(4, 2, false) +
                "0 0 0 7\n1.50 0 0 7\n1 1 0 8\n0 1 0 7\n10 3 0 1 2 2 0.5 1 7\n"
                "11 4 3 0 2 1 0 7\n");
  EXPECT_EQ(ReadAll(folder_ / files[1].path),
            Header(3, 1, false) + "1.50 0 0 7\n1 1 0 8\n2 2 2 8\n12 3 2 1 0 1 0.25 8\n");
}

// In either order of bytes; of a mesh of two balls, the parts are the balls again.
TEST_F(PlySplitTest, PartsOfAMeshAreWhatTheyWere) {
  PolygonMesh balls;
  AddBall({0, 0, 0}, 1, 8, &balls);
  const size_t of_first = balls.NumFaces();
  AddBall({3, 0, 0}, 1, 8, &balls);
  for (const bool is_big_endian : {false, true}) {
    std::string ply = std::string("ply\nformat ") +
                      (is_big_endian ? "binary_big_endian" : "binary_little_endian") +
                      " 1.0\nelement vertex " + std::to_string(balls.vertices.size()) +
                      "\nproperty double x\nproperty double y\nproperty double z\nproperty int "
                      "label\nelement face " +
                      std::to_string(balls.NumFaces()) +
                      "\nproperty list uchar ushort vertex_index\nproperty int label\nend_header\n";
    const auto append = [&](const auto& value) {
      AppendBinary(value, &ply);
      if (is_big_endian) std::reverse(ply.end() - sizeof(value), ply.end());
    };
    for (const Eigen::Vector3d& x : balls.vertices) {
      for (const double coordinate : x) append(coordinate);
      append(int32_t{0});
    }
    for (size_t f = 0; f < balls.NumFaces(); ++f) {
      append(uint8_t{3});
      for (const uint32_t corner : balls.Face(f)) append(static_cast<uint16_t>(corner));
      append(int32_t{f < of_first ? 7 : 8});
    }
    const std::vector<WrittenFile> files = Split(ply);
    ASSERT_EQ(files.size(), 2u);
    for (int part = 0; part < 2; ++part) {
      const PolygonMesh mesh = ReadPolygonMesh(folder_ / files[part].path);
      RequireValidMesh(files[part].path, mesh);
      ASSERT_EQ(mesh.NumFaces(), of_first);
      for (size_t f = 0; f < mesh.NumFaces(); ++f) {
        const size_t whole = f + (part == 0 ? 0 : of_first);
        for (int k = 0; k < 3; ++k) {
          EXPECT_EQ(mesh.vertices[mesh.Face(f)[k]], balls.vertices[balls.Face(whole)[k]]);
        }
      }
    }
  }
}

TEST_F(PlySplitTest, CloudsAreSplitByTheirPoints) {
  const std::vector<WrittenFile> files = Split(
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty int label\nproperty int x\nproperty "
      "int y\nproperty int z\nend_header\n7 1 2 3\n8 4 5 6\n7 7 8 9\n0 0 0 0\n");
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].summary, "2 points");
  EXPECT_EQ(ReadPolygonMesh(folder_ / files[0].path).vertices,
            (std::vector<Eigen::Vector3d>{{1, 2, 3}, {7, 8, 9}}));
  EXPECT_EQ(ReadPolygonMesh(folder_ / files[1].path).vertices,
            (std::vector<Eigen::Vector3d>{{4, 5, 6}}));
}

}  // namespace
}  // namespace semfoam
