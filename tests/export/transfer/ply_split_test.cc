// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/ply_split.h"

#include "foam/util/error.h"

#include <algorithm>
#include <fstream>
#include <map>

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

// How often each edge is passed one way and the other way.
std::map<std::pair<uint32_t, uint32_t>, std::pair<int, int>> EdgeUses(const PolygonMesh& mesh) {
  std::map<std::pair<uint32_t, uint32_t>, std::pair<int, int>> uses;
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    const auto face = mesh.Face(f);
    for (size_t k = 0; k < face.size(); ++k) {
      const uint32_t a = face[k], b = face[(k + 1) % face.size()];
      auto& [up, down] = uses[std::minmax(a, b)];
      ++(a < b ? up : down);
    }
  }
  return uses;
}

// A cube of quads, of which the top and one side are another object: closed both, in text and in
// binary, and what is not the cap's stays as it is.
TEST_F(PlySplitTest, CapsCloseThePartsOfAClosedMesh) {
  const std::string header =
      "element vertex 8\nproperty float x\nproperty double y\nproperty float z\nproperty int "
      "label\nelement face 6\nproperty uchar shade\nproperty list uchar int vertex_indices\n"
      "property int label\nend_header\n";
  const int faces[6][5] = {{0, 2, 3, 1, 7},
                           {4, 5, 7, 6, 8},
                           {0, 1, 5, 4, 8},
                           {2, 6, 7, 3, 7},
                           {0, 4, 6, 2, 7},
                           {1, 3, 7, 5, 7}};
  for (const bool is_text : {true, false}) {
    std::string ply = std::string("ply\nformat ") + (is_text ? "ascii" : "binary_little_endian") +
                      " 1.0\n" + header;
    for (int v = 0; v < 8; ++v) {
      const int x = v & 1, y = v >> 1 & 1, z = v >> 2;
      if (is_text) {
        ply += std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + " 99\n";
      } else {
        AppendBinary(static_cast<float>(x), &ply);
        AppendBinary(static_cast<double>(y), &ply);
        AppendBinary(static_cast<float>(z), &ply);
        AppendBinary(int32_t{99}, &ply);
      }
    }
    for (const auto& face : faces) {
      if (is_text) {
        ply += "5 4";
        for (const int number : face) ply += " " + std::to_string(number);
        ply += "\n";
      } else {
        AppendBinary(uint8_t{5}, &ply);
        AppendBinary(uint8_t{4}, &ply);
        for (const int number : face) AppendBinary(int32_t{number}, &ply);
      }
    }
    std::ofstream(folder_ / "in.ply", std::ios::binary) << ply;
    const std::vector<WrittenFile> files =
        SplitLabelledPly(folder_ / "in.ply", folder_, {}, /*cap=*/true);
    ASSERT_EQ(files.size(), 2u);
    EXPECT_EQ(files[0].summary, "9 vertices, 10 faces, 1 cap");
    EXPECT_EQ(files[1].summary, "7 vertices, 8 faces, 1 cap");
    for (const WrittenFile& file : files) {
      const PolygonMesh mesh = ReadPolygonMesh(folder_ / file.path);
      RequireValidMesh(file.path, mesh);
      for (const auto& [edge, uses] : EdgeUses(mesh)) {
        EXPECT_EQ(uses, std::pair(1, 1)) << edge.first << " " << edge.second;
      }
      EXPECT_LT((mesh.vertices.back() - Eigen::Vector3d(0.5, 0.5, 0.5)).norm(), 0.6);
      if (!is_text) continue;
      const std::string text = ReadAll(folder_ / file.path);
      EXPECT_NE(text.find("0.5 0.3333333333333333 0.6666667 99\n"), std::string::npos) << text;
    }
  }
}

// A hole of three corners is one triangle.
TEST_F(PlySplitTest, CapsOfOpenMeshes) {
  const std::string start =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty int x\nproperty int y\nproperty int z\n"
      "property int label\nelement face 3\nproperty list uchar int vertex_index\nproperty int "
      "label\nend_header\n"
      "0 0 0 7\n1 0 0 7\n0 1 0 7\n0 0 1 7\n";
  std::ofstream(folder_ / "in.ply") << start + "3 0 2 1 7\n3 0 1 3 7\n3 1 2 3 7\n";
  std::vector<WrittenFile> files = SplitLabelledPly(folder_ / "in.ply", folder_, {}, true);
  EXPECT_EQ(files[0].summary, "4 vertices, 4 faces, 1 cap");
  for (const auto& [edge, uses] : EdgeUses(ReadPolygonMesh(folder_ / files[0].path))) {
    EXPECT_EQ(uses, std::pair(1, 1));
  }
}

// A ball without its upper half, of more vertices than a byte can count.
TEST_F(PlySplitTest, CapsNeedRoomInTheIndices) {
  PolygonMesh ball;
  AddBall({0, 0, 0}, 1, 8, &ball);
  std::string ply =
      "ply\nformat ascii 1.0\nelement vertex " + std::to_string(ball.vertices.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\nproperty int label\nelement face " +
      std::to_string(ball.NumFaces()) +
      "\nproperty list uchar uchar vertex_index\nproperty int label\nend_header\n";
  for (const Eigen::Vector3d& x : ball.vertices) {
    for (const double coordinate : x) ply += std::to_string(coordinate) + " ";
    ply += "7\n";
  }
  for (size_t f = 0; f < ball.NumFaces(); ++f) {
    ply += "3";
    for (const uint32_t corner : ball.Face(f)) ply += " " + std::to_string(corner);
    ply += f % 50 == 0 ? " 8\n" : " 7\n";
  }
  std::ofstream(folder_ / "in.ply") << ply;
  try {
    SplitLabelledPly(folder_ / "in.ply", folder_, {}, /*cap=*/true);
    ADD_FAILURE() << "accepted";
  } catch (const UserError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("its corners are numbers of 1 bytes"));
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "objects/7_label_7.ply"));
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
