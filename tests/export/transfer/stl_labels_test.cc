// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/stl_labels.h"

#include "foam/util/error.h"

#include <fstream>

#include "tests/export/test_foams.h"
#include "tests/export/transfer/test_meshes.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class StlLabelsTest : public TemporaryFolderTest {
 protected:
  fs::path Write(const std::string& bytes) {
    std::ofstream(folder_ / "in.stl", std::ios::binary) << bytes;
    return folder_ / "in.stl";
  }
  std::string Refusal(const std::string& bytes) {
    try {
      ReadStl(Write(bytes));
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  }
  std::string ReadAll(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
};

constexpr SurfaceLabel kMug{LabelId{7}, 0.5f}, kOther{LabelId{8}, 0.25f}, kNone{};
const std::vector<Label> kLabels = {{LabelId{7}, MaskId{7}, "mug"}};

// A tetrahedron.
constexpr char kText[] =
    "SOLID my facet\n  facet normal 0 0 -1\n outer loop\nvertex 0 0 0\nvertex 0 1e0 0\nvertex +1 0 "
    "0\nendloop\n endfacet\r\nfacet normal 0 0 0\nouter loop vertex 0 0 0 vertex 1 -0 0 vertex 0 0 "
    "1.125 endloop endfacet facet normal 0 0 0\nouter loop\nvertex 0 0 1.125\nvertex 0 1 0\nvertex "
    "-0 0 0\nendloop\nendfacet\nendsolid my facet\nsolid\nfacet normal 1 1 1\nouter loop\nvertex 1 "
    "0 0\nvertex 0 1 0\nvertex 0 0 1.125\nendloop\nendfacet\nendsolid";

TEST_F(StlLabelsTest, ReadsText) {
  const StlMesh stl = ReadStl(Write(kText));
  ASSERT_EQ(stl.mesh.NumFaces(), 4u);
  EXPECT_EQ(stl.mesh.vertices,
            (std::vector<Eigen::Vector3d>{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1.125}}));
  EXPECT_THAT(stl.mesh.Face(0), ElementsAre(0, 1, 2));
  EXPECT_THAT(stl.mesh.Face(1), ElementsAre(0, 2, 3));
  EXPECT_THAT(stl.mesh.Face(2), ElementsAre(3, 1, 0));
  EXPECT_THAT(stl.mesh.Face(3), ElementsAre(2, 1, 3));
}

// Binary facets with their normals and bytes; the first one may begin with `solid`.
TEST_F(StlLabelsTest, BinaryBecomesAPlyWithAllOfIt) {
  PolygonMesh ball;
  AddBall({0, 0, 0}, 1, 8, &ball);
  for (Eigen::Vector3d& x : ball.vertices) x = x.cast<float>().cast<double>();
  const std::string bytes = StlOf(ball, "solid that is none");
  const StlMesh stl = ReadStl(Write(bytes));
  EXPECT_FALSE(stl.is_text);
  ASSERT_EQ(stl.mesh.NumFaces(), ball.NumFaces());
  // The ball's poles and its seam are there more than once.
  EXPECT_LT(stl.mesh.vertices.size(), ball.vertices.size());
  std::vector<SurfaceLabel> faces(ball.NumFaces(), kMug);
  faces[3] = kNone;
  WriteStlAsLabelledPly(stl,
                        folder_ / "out.ply",
                        kLabels,
                        std::vector<SurfaceLabel>(stl.mesh.vertices.size(), kOther),
                        faces);
  const PlyLabels labels = ReadPlyLabels(folder_ / "out.ply");
  EXPECT_EQ(labels.faces, faces);
  EXPECT_EQ(labels.vertices, std::vector<SurfaceLabel>(stl.mesh.vertices.size(), kOther));
  const PolygonMesh mesh = ReadPolygonMesh(folder_ / "out.ply");
  EXPECT_EQ(mesh.vertices, stl.mesh.vertices);
  EXPECT_EQ(mesh.corners, stl.mesh.corners);
  EXPECT_THAT(ReadAll(folder_ / "out.ply"), HasSubstr("comment label 7 mug\n"));

  PlyReader reader(folder_ / "out.ply", "a PLY");
  for (const PlyElement& element : reader.header().elements) {
    if (element.name != "face") {
      reader.ReadRecords(element, [](uint64_t, size_t, double) {});
      continue;
    }
    const size_t nx = reader.RequireProperty(element, {"nx"});
    const size_t attribute = reader.RequireProperty(element, {"attribute"});
    reader.ReadRecords(element, [&](uint64_t f, size_t column, double value) {
      EXPECT_TRUE(column != nx || value == 0.5) << value;
      EXPECT_TRUE(column != attribute || value == static_cast<double>(f)) << value;
    });
  }
}

TEST_F(StlLabelsTest, PartsHoldTheirFacetsByteForByte) {
  PolygonMesh ball;
  AddBall({0, 0, 0}, 1, 8, &ball);
  const std::string bytes = StlOf(ball, "a header");
  const StlMesh stl = ReadStl(Write(bytes));
  std::vector<SurfaceLabel> faces(ball.NumFaces(), kMug);
  for (size_t f = 0; f < 60; ++f) faces[f] = kOther;
  faces.back() = kNone;
  const std::vector<WrittenFile> files = SplitLabelledStl(stl, folder_, kLabels, faces, false);
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[0].path, "objects/7_mug.stl");
  EXPECT_EQ(files[1].path, "objects/8_label_8.stl");
  const std::string first = ReadAll(folder_ / files[0].path);
  const std::string second = ReadAll(folder_ / files[1].path);
  EXPECT_EQ(second.substr(0, 80), bytes.substr(0, 80));
  EXPECT_EQ(second.substr(84), bytes.substr(84, 60 * 50));
  EXPECT_EQ(first.substr(84), bytes.substr(84 + 60 * 50, (ball.NumFaces() - 61) * 50));
  EXPECT_EQ(ReadStl(folder_ / files[0].path).mesh.NumFaces(), ball.NumFaces() - 61);
}

TEST_F(StlLabelsTest, PartsMayBeClosed) {
  for (const bool is_text : {true, false}) {
    const StlMesh text = ReadStl(Write(kText));
    const StlMesh stl = is_text ? text : ReadStl(Write(StlOf(text.mesh, "")));
    const std::vector<WrittenFile> files =
        SplitLabelledStl(stl, folder_, kLabels, {kMug, kMug, kMug, kNone}, true);
    ASSERT_EQ(files.size(), 1u);
    EXPECT_EQ(files[0].summary, "4 vertices, 4 faces, 1 cap");
    const StlMesh part = ReadStl(folder_ / files[0].path);
    EXPECT_EQ(part.is_text, is_text);
    ASSERT_EQ(part.mesh.NumFaces(), 4u);
    Eigen::Vector3d area = Eigen::Vector3d::Zero();
    for (size_t f = 0; f < 4; ++f) area += part.mesh.FaceArea(f);
    EXPECT_LT(area.norm(), 1e-12) << "closed and oriented";
    if (is_text) {
      EXPECT_THAT(ReadAll(folder_ / files[0].path),
                  HasSubstr("solid 7_mug\nfacet normal 0 0 -1\n outer loop\nvertex 0 0 0\nvertex 0 "
                            "1e0 0\nvertex +1 0 0\nendloop\n endfacet\r\nfacet"));
    }
  }
}

TEST_F(StlLabelsTest, RefusesBadFilesWithOneSentence) {
  EXPECT_THAT(Refusal(""), HasSubstr("in.stl: has 0 bytes"));
  EXPECT_THAT(Refusal("solid x\nendsolid x\n"), HasSubstr("has no triangles"));
  const std::string text = kText;
  EXPECT_THAT(Refusal(text.substr(0, text.find("endsolid"))), HasSubstr("ends without `endsolid`"));
  EXPECT_THAT(Refusal(text.substr(0, text.size() - 30)), HasSubstr("line 19 is no facet"));
  EXPECT_THAT(Refusal("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0\nvertex"),
              HasSubstr("line 2 is no facet"));
  EXPECT_THAT(Refusal("solid\nendsolid\nfacet normal 0 0 1"), HasSubstr("line 3 is no facet"));
  PolygonMesh ball;
  AddBall({0, 0, 0}, 1, 4, &ball);
  const std::string binary = StlOf(ball, "header");
  EXPECT_THAT(Refusal(binary.substr(0, 1000)),
              HasSubstr("says 48 triangles, but its size, 1000 bytes, is that of 18"));
  EXPECT_THAT(Refusal(StlOf(ball, "solid").substr(0, 1000)), HasSubstr("says 48 triangles"));
  std::string wrong = binary;
  wrong[83] = '\x7f';
  EXPECT_THAT(Refusal(wrong), HasSubstr("says 2130706480 triangles"));
  PolygonMesh none;
  EXPECT_THAT(Refusal(StlOf(none, "")), HasSubstr("has no triangles"));
}

// Of cuts and changed bytes, a mesh or a refusal.
TEST_F(StlLabelsTest, DamagedTextIsReadOrRefused) {
  const std::string whole = kText;
  int refused = 0;
  for (size_t at = 0; at < whole.size(); at += 3) {
    std::vector<std::string> damaged = {whole.substr(0, at)};
    for (const char byte : {'\0', '\n', '-', '9', '\xff'}) {
      damaged.push_back(whole);
      damaged.back()[at] = byte;
    }
    for (const std::string& bytes : damaged) {
      const std::string refusal = Refusal(bytes);
      if (refusal.empty()) continue;
      EXPECT_THAT(refusal, HasSubstr("in.stl: "));
      ++refused;
    }
  }
  EXPECT_GT(refused, 400);
}

}  // namespace
}  // namespace semfoam
