// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/om_labels.h"

#include "export/surface/semantic_mesh.h"
#include "foam/util/error.h"

#include <fstream>

#include "tests/export/test_foams.h"
#include "tests/export/transfer/test_meshes.h"
#include "tests/small_files.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class OmLabelsTest : public TemporaryFolderTest {
 protected:
  fs::path Write(const std::string& bytes) {
    std::ofstream(folder_ / "in.om", std::ios::binary) << bytes;
    return folder_ / "in.om";
  }
  std::string Copy(const fs::path& input,
                   const std::vector<SurfaceLabel>& vertices,
                   const std::vector<SurfaceLabel>& faces) {
    CopyOmWithLabels(input, folder_ / "out.om", vertices, faces);
    std::ifstream in(folder_ / "out.om", std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::string Refusal(const std::string& bytes) {
    const fs::path path = Write(bytes);
    try {
      RequireValidMesh(path, ReadOmPolygonMesh(path));
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  }
};

constexpr SurfaceLabel kMug{LabelId{7}, 0.5f}, kOther{LabelId{300}, 0.25f}, kNone{};

// What OpenMesh wrote, and a property of somebody else's, stay; OpenMesh reads the labels.
TEST_F(OmLabelsTest, OpenMeshRestoresTheLabels) {
  SemanticMesh mesh;
  PolygonMesh ball;
  AddBall({1e6, 0, 0}, 1, 8, &ball);
  std::vector<SemanticMesh::VertexHandle> handles;
  for (const Eigen::Vector3d& x : ball.vertices) {
    handles.push_back(mesh.add_vertex({x.x(), x.y(), x.z()}));
  }
  for (size_t f = 0; f < ball.NumFaces(); ++f) {
    mesh.add_face(handles[ball.Face(f)[0]], handles[ball.Face(f)[1]], handles[ball.Face(f)[2]]);
  }
  OpenMesh::VPropHandleT<double> heat;
  mesh.add_property(heat, "heat");
  mesh.property(heat).set_persistent(true);
  mesh.property(heat, handles[5]) = 0.75;
  ASSERT_TRUE(
      OpenMesh::IO::write_mesh(mesh, (folder_ / "in.om").string(), OpenMesh::IO::Options::Custom));

  std::vector<SurfaceLabel> vertices(ball.vertices.size(), kOther), faces(ball.NumFaces(), kMug);
  vertices[3] = kNone;
  faces[9] = kOther;
  const std::string copy = Copy(folder_ / "in.om", vertices, faces);
  SemanticMesh read;
  ASSERT_TRUE(OpenMesh::IO::read_mesh(read, (folder_ / "out.om").string()));
  ASSERT_EQ(read.n_faces(), faces.size());
  OpenMesh::VPropHandleT<int> vertex_label;
  OpenMesh::VPropHandleT<double> read_heat;
  OpenMesh::FPropHandleT<int> face_label;
  OpenMesh::FPropHandleT<float> face_confidence;
  ASSERT_TRUE(read.get_property_handle(vertex_label, kLabelProperty));
  ASSERT_TRUE(read.get_property_handle(read_heat, "heat"));
  ASSERT_TRUE(read.get_property_handle(face_label, kLabelProperty));
  ASSERT_TRUE(read.get_property_handle(face_confidence, kConfidenceProperty));
  EXPECT_EQ(read.property(vertex_label, handles[3]), 0);
  EXPECT_EQ(read.property(vertex_label, handles[4]), 300);
  EXPECT_EQ(read.property(read_heat, handles[5]), 0.75);
  EXPECT_EQ(read.property(face_label, OpenMesh::FaceHandle(8)), 7);
  EXPECT_EQ(read.property(face_label, OpenMesh::FaceHandle(9)), 300);
  EXPECT_EQ(read.property(face_confidence, OpenMesh::FaceHandle(9)), 0.25f);

  // A copy of the copy is the same; so all bytes but those of the labels are those of the input.
  EXPECT_EQ(Copy(folder_ / "out.om", vertices, faces), copy) << "labels are replaced";
}

TEST_F(OmLabelsTest, AllElseStaysByteForByte) {
  const std::string whole = SmallOmMesh();
  std::string expected = whole.substr(0, whole.find("\5label") - 2);
  for (const char entity : {'\xc2', '\xca'}) {
    const int count = entity == '\xc2' ? 3 : 1;
    expected += entity;
    expected += std::string("\0\5label\7int32_t", 15);
    AppendBinary(uint32_t(4 * count), &expected);
    for (int k = 0; k < count; ++k) AppendBinary(int32_t{7}, &expected);
    expected += entity;
    expected += std::string("\0\12confidence\5float", 18);
    AppendBinary(uint32_t(4 * count), &expected);
    for (int k = 0; k < count; ++k) AppendBinary(0.5f, &expected);
  }
  expected += whole.substr(whole.size() - 2);
  EXPECT_EQ(Copy(Write(whole), {kMug, kMug, kMug}, {kMug}), expected);
}

TEST_F(OmLabelsTest, RefusesBadFilesWithOneSentence) {
  EXPECT_THAT(Refusal("no mesh"), HasSubstr("in.om: is no OpenMesh file"));
  EXPECT_THAT(Refusal(SmallOmMesh().substr(0, 60)), HasSubstr("in.om: ends too early"));
  EXPECT_THAT(Refusal(SmallOmMesh(3, 2, 3)), HasSubstr("in.om: "));
  EXPECT_THAT(Refusal(SmallOmMesh(0xffffffff, 1, 3)), HasSubstr("in.om: "));
  std::string wrong = SmallOmMesh();
  // The vertex that the first halfedge leads to.
  wrong[16 + 2 + 72 + 2 + 13] = 9;
  EXPECT_THAT(Refusal(wrong), HasSubstr("face 0 has a corner that is no vertex"));
}

// Of cuts and changed bytes, a mesh or a refusal; what is read can be copied.
TEST_F(OmLabelsTest, DamagedFilesAreReadOrRefused) {
  const std::string whole = SmallOmMesh();
  int refused = 0;
  for (size_t at = 0; at < whole.size(); ++at) {
    std::vector<std::string> damaged = {whole.substr(0, at)};
    for (const char byte : {'\0', '\x7f', '\xff'}) {
      damaged.push_back(whole);
      damaged.back()[at] = byte;
    }
    for (const std::string& bytes : damaged) {
      const std::string refusal = Refusal(bytes);
      if (!refusal.empty()) {
        EXPECT_THAT(refusal, HasSubstr("in.om: "));
        ++refused;
        continue;
      }
      const PolygonMesh mesh = ReadOmPolygonMesh(folder_ / "in.om");
      Copy(folder_ / "in.om",
           std::vector<SurfaceLabel>(mesh.vertices.size()),
           std::vector<SurfaceLabel>(mesh.NumFaces()));
    }
  }
  EXPECT_GT(refused, 100);
}

}  // namespace
}  // namespace semfoam
