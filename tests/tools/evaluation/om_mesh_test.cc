// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/om_mesh.h"

#include "export/surface/semantic_mesh.h"

#include <algorithm>

#include "tests/plugin/test_util.h"
#include "tests/small_files.h"
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using testing::ElementsAre;

const testing::Matcher<std::vector<Eigen::Vector3d>> kTriangle =
    ElementsAre(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0));

class OmMeshTest : public testing::Test {
 protected:
  PolygonSoup Read(const std::string& bytes) const {
    WriteFile(folder_ / "a.om", bytes);
    return ReadOmMesh(folder_ / "a.om");
  }

  // From the lowest corner.
  static std::vector<size_t> Turned(std::vector<size_t> face) {
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
    return face;
  }

  TempFolder folder_;
};

TEST_F(OmMeshTest, ReadsWhatOpenMeshWrites) {
  OpenMesh::PolyMesh_ArrayKernelT<SemanticMeshTraits> mesh;
  std::vector<OpenMesh::VertexHandle> corners;
  // More than 127 vertices: numbers of two bytes.
  for (int i = 0; i < 201; ++i) corners.push_back(mesh.add_vertex({0.1 * i, 1e6 + 0.3 * i, i * i}));
  for (int i = 0; i + 3 < 200; i += 2) {
    mesh.add_face({corners[i], corners[i + 1], corners[i + 3], corners[i + 2]});
  }
  mesh.add_face({corners[198], corners[199], corners[200]});
  mesh.request_vertex_colors();
  mesh.request_vertex_normals();
  mesh.request_vertex_texcoords2D();
  mesh.request_face_colors();
  mesh.request_face_normals();
  using OpenMesh::IO::Options;
  const Options everything = Options::VertexColor | Options::VertexNormal |
                             Options::VertexTexCoord | Options::FaceColor | Options::FaceNormal |
                             Options::Custom;
  for (const Options& options : {Options(Options::Default), everything}) {
    ASSERT_TRUE(OpenMesh::IO::write_mesh(mesh, (folder_ / "b.om").string(), options));
    const PolygonSoup soup = ReadOmMesh(folder_ / "b.om");
    ASSERT_EQ(soup.vertices.size(), 201u);
    for (int i = 0; i < 201; ++i) {
      EXPECT_EQ(soup.vertices[i], Eigen::Vector3d(0.1 * i, 1e6 + 0.3 * i, i * i)) << i;
    }
    ASSERT_EQ(soup.faces.size(), 100u);
    EXPECT_THAT(Turned(soup.faces[0]), ElementsAre(0, 1, 3, 2));
    EXPECT_THAT(Turned(soup.faces[98]), ElementsAre(196, 197, 199, 198));
    EXPECT_THAT(Turned(soup.faces[99]), ElementsAre(198, 199, 200));
  }
}

TEST_F(OmMeshTest, ReadsTheSmallOne) {
  const PolygonSoup soup = Read(SmallOmMesh());
  EXPECT_THAT(soup.vertices, kTriangle);
  EXPECT_THAT(soup.faces, ElementsAre(ElementsAre(0, 1, 2)));
}

// Version 1 listed each face's corners: three, four, or as many as stand before them.
TEST_F(OmMeshTest, ReadsTheOldVersion) {
  const auto file = [](char kind, uint32_t num_faces) {
    std::string om = std::string("OM") + kind + "\x22";
    for (const uint32_t count : {3u, num_faces, 3u}) AppendBinary(count, &om);
    AppendBinary(uint16_t{0x1600}, &om);  // three floats each
    for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) AppendBinary(x, &om);
    AppendBinary(uint16_t{0x00e8}, &om);
    return om;
  };
  PolygonSoup soup = Read(file('T', 2) + std::string("\0\1\2\2\1\0", 6));
  EXPECT_THAT(soup.vertices, kTriangle);
  EXPECT_THAT(soup.faces, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(2, 1, 0)));
  soup = Read(file('Q', 1) + std::string("\0\1\2\1", 4));
  EXPECT_THAT(soup.faces, ElementsAre(ElementsAre(0, 1, 2, 1)));
  soup = Read(file('P', 2) + std::string("\3\0\0\1\2\2\0\1\xc8", 9));
  EXPECT_THAT(soup.faces, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(1, 200)));
}

}  // namespace
}  // namespace semfoam
