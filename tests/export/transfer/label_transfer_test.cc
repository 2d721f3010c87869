// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/label_transfer.h"

#include "export/surface/semantic_mesh.h"
#include "foam/util/error.h"
#include "foam/util/parallel.h"

#include <fstream>
#include <random>
#include <sstream>

#include "tests/export/test_foams.h"
#include "tests/export/transfer/test_meshes.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::HasSubstr;

constexpr LabelId kLeft{7}, kRight{8};

std::string ReadAll(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// The foam of two balls that touch, and a mesh of them that somebody else made: one mesh without
// labels. The truth is the side of the plane between them.
class LabelTransferTest : public TemporaryFolderTest {
 protected:
  LabelTransferTest() : scene_(MakeExportableScene(TouchingBalls(8000))) {
    AddBall({-0.3, 0, 0}, 0.295, 24, &mesh_);
    AddBall({0.3, 0, 0}, 0.295, 24, &mesh_);
  }

  TransferredLabels Transfer(const std::string& ply,
                             const LabelTransferOptions& options = {},
                             const ExportableScene* scene = nullptr) {
    std::ofstream(folder_ / "in.ply", std::ios::binary) << ply;
    FoamLabels source(scene == nullptr ? scene_ : *scene, options.tolerance);
    tolerance_ = source.Tolerance();
    return TransferLabels(
        &source, folder_ / "in.ply", folder_ / "out.ply", options, [](const std::string&, double) {
        });
  }
  PlyLabels Labels() { return ReadPlyLabels(folder_ / "out.ply"); }

  std::string Refusal(const std::string& ply, const LabelTransferOptions& options = {}) {
    try {
      Transfer(ply, options);
    } catch (const UserError& error) {
      EXPECT_FALSE(std::filesystem::exists(folder_ / "out.ply"));
      return error.what();
    }
    return "";
  }

  static LabelId Truth(const Eigen::Vector3d& x) { return x.x() < 0 ? kLeft : kRight; }

  // Share of the mesh's area with the right label.
  double RightArea(const PolygonMesh& mesh) {
    const PlyLabels labels = Labels();
    EXPECT_EQ(labels.faces.size(), mesh.NumFaces());
    double right = 0, all = 0;
    for (size_t f = 0; f < mesh.NumFaces(); ++f) {
      Eigen::Vector3d center = Eigen::Vector3d::Zero();
      for (const uint32_t corner : mesh.Face(f)) center += mesh.vertices[corner];
      const double area = mesh.FaceArea(f).norm();
      all += area;
      if (labels.faces[f].id == Truth(center)) right += area;
    }
    return right / all;
  }

  const ExportableScene scene_;
  PolygonMesh mesh_;
  double tolerance_ = 0;
};

TEST_F(LabelTransferTest, AMeshOfSomebodyElseGetsItsLabels) {
  const TransferredLabels transferred = Transfer(PlyOf(mesh_));
  EXPECT_GE(RightArea(mesh_), 0.995);
  const PlyLabels labels = Labels();
  ASSERT_EQ(labels.vertices.size(), mesh_.vertices.size());
  size_t right = 0;
  for (size_t v = 0; v < mesh_.vertices.size(); ++v) {
    right += labels.vertices[v].id == Truth(mesh_.vertices[v]);
    EXPECT_GE(labels.vertices[v].confidence, 0);
    EXPECT_LE(labels.vertices[v].confidence, 1);
  }
  EXPECT_GE(right, mesh_.vertices.size() * 99 / 100);
  EXPECT_EQ(transferred.vertices, std::ssize(mesh_.vertices));
  EXPECT_EQ(transferred.faces, std::ssize(mesh_.corners) / 3);
  EXPECT_EQ(transferred.unknown, 0);
  ASSERT_EQ(transferred.labels.size(), 2u);
  EXPECT_EQ(transferred.labels[0].name, "mug");
  EXPECT_NEAR(transferred.labels[0].area, transferred.area / 2, 0.01 * transferred.area);
  EXPECT_NEAR(transferred.labels[1].box.min().x(), 0.005, 0.03);
}

// Labels become groups; what a texture needs is as it was.
TEST_F(LabelTransferTest, AnObjGetsItsLabelsAsGroups) {
  std::ofstream(folder_ / "in.mtl") << "newmtl all\n";
  const std::filesystem::path path = folder_ / "in.obj";
  {
    std::ofstream obj(path);
    obj.precision(17);
    obj << "mtllib in.mtl\nvt 0.25 0.5\nusemtl all\n";
    for (const Eigen::Vector3d& x : mesh_.vertices) obj << "v " << x.transpose() << "\n";
    for (size_t f = 0; f < mesh_.NumFaces(); ++f) {
      obj << "f";
      for (const uint32_t corner : mesh_.Face(f)) obj << " " << corner + 1 << "/1";
      obj << "\n";
    }
  }
  FoamLabels source(scene_, 0);
  const TransferredLabels transferred =
      TransferLabels(&source, path, folder_ / "out/in.obj", {}, [](const std::string&, double) {});
  EXPECT_EQ(transferred.faces, std::ssize(mesh_.corners) / 3);
  EXPECT_EQ(ReadAll(folder_ / "out/in.mtl"), "newmtl all\n");

  std::istringstream labelled(ReadAll(folder_ / "out/in.obj"));
  std::string without_groups, group;
  size_t face = 0, right = 0;
  for (std::string line; std::getline(labelled, line);) {
    if (line.starts_with("g ")) {
      group = line;
      continue;
    }
    without_groups += line + "\n";
    if (!line.starts_with("f ")) continue;
    right +=
        group == (Truth(mesh_.vertices[mesh_.Face(face)[0]]) == kLeft ? "g 7_mug" : "g 8_label_8");
    ++face;
  }
  EXPECT_EQ(without_groups, ReadAll(path));
  EXPECT_GE(right, face * 98 / 100);
}

// The same mesh in the formats of others; the file is recognised by its content.
TEST_F(LabelTransferTest, EveryFormatGetsTheSameLabels) {
  for (Eigen::Vector3d& x : mesh_.vertices) x = x.cast<float>().cast<double>();
  Transfer(PlyOf(mesh_));
  const std::vector<SurfaceLabel> expected = Labels().faces;
  FoamLabels source(scene_, 0);
  const auto transfer = [&](const std::string& bytes, const std::string& output) {
    const std::filesystem::path input = folder_ / "mesh of somebody";
    std::ofstream(input, std::ios::binary) << bytes;
    EXPECT_EQ(TransferLabels(
                  &source, input, folder_ / output, {}, [](const std::string&, double) { return; })
                  .faces,
              std::ssize(expected));
  };
  // What is one vertex of the mesh, and what the cut sees, are the same.
  transfer(StlOf(mesh_, "of somebody"), "out.ply");
  EXPECT_GE(RightArea(mesh_), 0.995);
  const std::vector<SurfaceLabel> of_stl = Labels().faces;
  size_t same = 0;
  for (size_t f = 0; f < expected.size(); ++f) same += of_stl[f].id == expected[f].id;
  EXPECT_GE(same, expected.size() - 4);

  // A mesh that OpenMesh takes: the poles and seams of the balls are no manifold there, faces stay.
  SemanticMesh om;
  for (const Eigen::Vector3d& x : mesh_.vertices) om.add_vertex({x.x(), x.y(), x.z()});
  for (size_t f = 0; f < mesh_.NumFaces(); ++f) {
    const auto at = [&](int k) { return OpenMesh::VertexHandle(mesh_.Face(f)[k]); };
    ASSERT_TRUE(om.add_face(at(0), at(1), at(2)).is_valid());
  }
  ASSERT_TRUE(OpenMesh::IO::write_mesh(om, (folder_ / "in.om").string()));
  transfer(ReadAll(folder_ / "in.om"), "out.om");
  SemanticMesh labelled;
  ASSERT_TRUE(OpenMesh::IO::read_mesh(labelled, (folder_ / "out.om").string()));
  OpenMesh::FPropHandleT<int> label;
  ASSERT_TRUE(labelled.get_property_handle(label, kLabelProperty));
  for (size_t f = 0; f < expected.size(); ++f) {
    EXPECT_EQ(labelled.property(label, OpenMesh::FaceHandle(static_cast<int>(f))),
              Value(expected[f].id));
  }
}

// Noise on the places, as of fused.ply, with and without normals; and outliers far off, which get
// no label.
TEST_F(LabelTransferTest, AScatteredCloudGetsItsLabels) {
  std::mt19937 random(6);
  std::normal_distribution<double> noise(0, 0.01);
  PolygonMesh cloud = mesh_;
  for (size_t v = 0; v < cloud.vertices.size(); ++v) {
    Eigen::Vector3d& x = cloud.vertices[v];
    const Eigen::Vector3d center(Truth(x) == kLeft ? -0.3 : 0.3, 0, 0);
    cloud.normals.push_back((x - center).normalized().cast<float>());
    x += Eigen::Vector3d(noise(random), noise(random), noise(random));
  }
  const size_t count = cloud.vertices.size();
  for (int k = 0; k < 50; ++k) {
    cloud.vertices.emplace_back(0, 0.9, 0.01 * k);
    cloud.normals.emplace_back(0, 0, 0);
  }
  for (const bool has_normals : {true, false}) {
    if (!has_normals) cloud.normals.clear();
    const TransferredLabels transferred = Transfer(PlyOf(cloud, /*is_cloud=*/true));
    const PlyLabels labels = Labels();
    ASSERT_EQ(labels.vertices.size(), count + 50);
    EXPECT_TRUE(labels.faces.empty());
    size_t right = 0;
    for (size_t v = 0; v < count; ++v) right += labels.vertices[v].id == Truth(mesh_.vertices[v]);
    EXPECT_GE(right, count * 97 / 100) << has_normals;
    for (size_t v = count; v < count + 50; ++v) EXPECT_EQ(labels.vertices[v], SurfaceLabel());
    EXPECT_EQ(transferred.unknown, 50);
    EXPECT_EQ(transferred.asked, static_cast<int64_t>(count) + 50);
  }
}

// Holes, triangles that share nothing, and faces on both sides of one another.
TEST_F(LabelTransferTest, BrokenMeshesGetTheirLabels) {
  PolygonMesh broken;
  for (size_t f = 0; f < mesh_.NumFaces(); ++f) {
    if (f % 7 == 0) continue;
    const auto first = static_cast<uint32_t>(broken.vertices.size());
    for (const uint32_t corner : mesh_.Face(f)) broken.vertices.push_back(mesh_.vertices[corner]);
    AddFace({first, first + 1, first + 2}, &broken);
    if (f % 5 == 0) AddFace({first + 2, first + 1, first}, &broken);
  }
  Transfer(PlyOf(broken));
  EXPECT_GE(RightArea(broken), 0.99);
}

TEST_F(LabelTransferTest, TheFrameIsThatOfTheFiles) {
  ExportableSceneOptions options;
  options.transform.scale = 100;
  options.transform.translation = {5e5, 4.5e6, 100};
  const ExportableScene moved = MakeExportableScene(TouchingBalls(8000), options);
  PolygonMesh mesh = mesh_;
  for (Eigen::Vector3d& x : mesh.vertices) x = 100 * x + options.transform.translation;
  const TransferredLabels there = Transfer(PlyOf(mesh), {}, &moved);
  const PlyLabels labels = Labels();
  const double tolerance = tolerance_;
  const TransferredLabels here = Transfer(PlyOf(mesh_));
  EXPECT_NEAR(tolerance, 100 * tolerance_, 1e-6);
  EXPECT_NEAR(there.labels[0].area, 1e4 * here.labels[0].area, 100);
  const PlyLabels expected = Labels();
  size_t same = 0;
  for (size_t f = 0; f < mesh.NumFaces(); ++f) same += labels.faces[f].id == expected.faces[f].id;
  EXPECT_GE(same, mesh.NumFaces() - 4);
}

// The sentence says how far off a mesh in another frame is.
TEST_F(LabelTransferTest, AnotherFrameIsTold) {
  PolygonMesh moved = mesh_;
  for (Eigen::Vector3d& x : moved.vertices) x += Eigen::Vector3d(0, 0, 50);
  for (const bool is_cloud : {false, true}) {
    const std::string sentence = Refusal(PlyOf(moved, is_cloud));
    EXPECT_THAT(sentence, HasSubstr("in.ply: 100 % of its vertices are farther than 0."));
    EXPECT_THAT(sentence, HasSubstr("half of them farther than 49."));
    EXPECT_THAT(sentence, HasSubstr("by 49.98"));
    EXPECT_THAT(sentence, HasSubstr("transform"));
  }
  for (Eigen::Vector3d& x : moved.vertices) x -= Eigen::Vector3d(0, 0, 49.2);
  EXPECT_THAT(Refusal(PlyOf(moved)), HasSubstr("tolerance"));
  LabelTransferOptions far;
  far.tolerance = 1;
  EXPECT_EQ(Refusal(PlyOf(moved), far), "");
}

TEST_F(LabelTransferTest, WhatIsNoMeshIsRefused) {
  const std::string ply = PlyOf(mesh_);
  EXPECT_THAT(Refusal(ply.substr(0, 1000)), HasSubstr("in.ply: ends too early"));
  PolygonMesh wrong = mesh_;
  wrong.corners[7] = 1000000;
  EXPECT_THAT(Refusal(PlyOf(wrong)),
              HasSubstr("in.ply: face 2 has a corner that is no vertex of the file"));
  EXPECT_THAT(Refusal(PlyOf({}, true)), HasSubstr("in.ply: has no vertices"));
  LabelTransferOptions options;
  options.tolerance = -1;
  EXPECT_THROW(options.RequireValid(), FieldError);
  options = {};
  options.smoothness = -2;
  EXPECT_THROW(options.RequireValid(), FieldError);
}

TEST_F(LabelTransferTest, SameBytesOnAnyNumberOfThreads) {
  for (const bool is_cloud : {false, true}) {
    std::vector<std::string> bytes;
    for (const int threads : {1, 3}) {
      const ThreadLimit limit(threads);
      Transfer(PlyOf(mesh_, is_cloud));
      bytes.push_back(ReadAll(folder_ / "out.ply"));
    }
    EXPECT_EQ(bytes[0], bytes[1]);
  }
}

}  // namespace
}  // namespace semfoam
