// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/mesh_score.h"

#include "export/io/surface_export.h"
#include "foam/util/error.h"
#include "foam/util/parallel.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <string>

#include "tests/export/test_foams.h"
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

// A square of this edge in the plane z, from the origin on, as two triangles.
TriangleMesh Square(double edge, double z) {
  return {{{0, 0, z}, {edge, 0, z}, {edge, edge, z}, {0, edge, z}}, {{0, 1, 2}, {0, 2, 3}}};
}

TEST(MeshScore, DistancesAreThoseToTheSurfaceAndNotToItsCorners) {
  TriangleMesh square = Square(2, 1);
  square.triangles.push_back({1, 1, 3});  // no area
  const std::vector<double> distances =
      DistancesToSurface(square, {{1, 1, 1}, {1.3, 0.2, 4}, {3, 1, 1}, {-3, -4, 1}, {1, 1, 0.5}});
  const double expected[] = {0, 3, 1, 5, 0.5};
  ASSERT_EQ(distances.size(), 5u);
  for (int k = 0; k < 5; ++k) EXPECT_NEAR(distances[k], expected[k], 1e-12);
}

TEST(MeshScore, DistancesToPointsAreThoseToTheNearest) {
  const Eigen::Vector3d far(5e5, 4.5e6, 300);
  const std::vector<double> distances = DistancesToPoints(
      {far, far + Eigen::Vector3d(1, 0, 0)},
      {far, far + Eigen::Vector3d(0.75, 0, 0), far + Eigen::Vector3d(0.25, 0, 3)});
  ASSERT_EQ(distances.size(), 3u);
  EXPECT_EQ(distances[0], 0);
  EXPECT_EQ(distances[1], 0.25);
  EXPECT_DOUBLE_EQ(distances[2], std::hypot(0.25, 3));
}

TEST(MeshScore, FarFromTheOriginNothingIsLost) {
  const Eigen::Vector3d far(5e5, 4.5e6, 300);
  TriangleMesh square = Square(2, 0);
  for (Eigen::Vector3d& x : square.vertices) x += far;
  const std::vector<double> distances =
      DistancesToSurface(square, {far + Eigen::Vector3d(1, 1, 1e-3)});
  EXPECT_NEAR(distances[0], 1e-3, 1e-8);
}

TEST(MeshScore, SamplesLieEvenlyOnTheSurface) {
  // Of two squares one has four times the area.
  TriangleMesh mesh = Square(1, 0);
  const TriangleMesh other = Square(2, 5);
  for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({a + 4, b + 4, c + 4});
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  const std::vector<Eigen::Vector3d> points = SampleSurface(mesh, 10000);
  ASSERT_EQ(points.size(), 10000u);
  int low = 0, quarter = 0;
  for (const Eigen::Vector3d& x : points) {
    EXPECT_TRUE(x.z() == 0 || x.z() == 5);
    EXPECT_GE(x.head<2>().minCoeff(), 0);
    EXPECT_LE(x.head<2>().maxCoeff(), x.z() == 0 ? 1 : 2);
    low += x.z() == 0;
    quarter += x.z() == 5 && x.x() < 1 && x.y() < 1;
  }
  EXPECT_NEAR(low, 2000, 2);
  EXPECT_NEAR(quarter, 2000, 150);
  const ThreadLimit limit(1);
  EXPECT_EQ(SampleSurface(mesh, 10000), points);
}

// A mesh that covers half of the reference, above it, and as much that is far from it.
TEST(MeshScore, PrecisionRecallAndDistancesAreTheirFormulas) {
  const TriangleMesh reference = Square(3, 0);  // diagonal: sqrt(18)
  TriangleMesh mesh = {{{0, 0, 0.1},
                        {3, 0, 0.1},
                        {3, 1, 0.1},
                        {0, 1, 0.1},
                        {0, 0, 3},
                        {3, 0, 3},
                        {3, 3, 3},
                        {0, 3, 3}},
                       {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}}};
  const double diagonal = std::sqrt(18.0);
  const MeshScore score =
      ScoreMesh(mesh, reference, {}, {0.05 / diagonal, 0.11 / diagonal, 2}, Nearest::kSurface);
  EXPECT_NEAR(score.diagonal, diagonal, 1e-12);
  EXPECT_EQ(score.precision[0], 0);
  EXPECT_EQ(score.recall[0], 0);
  EXPECT_EQ(score.f_score[0], 0);
  // A quarter of the mesh is near; of the reference what is below, and sqrt(0.11^2 - 0.1^2) more.
  EXPECT_NEAR(score.precision[1], 0.25, 1e-3);
  const double recall = (1 + std::sqrt(0.0021)) / 3;
  EXPECT_NEAR(score.recall[1], recall, 3e-3);
  EXPECT_NEAR(score.f_score[1],
              2 * score.precision[1] * score.recall[1] / (score.precision[1] + score.recall[1]),
              1e-12);
  EXPECT_EQ(score.f_score[2], 1);
  EXPECT_NEAR(score.accuracy * diagonal, 0.25 * 0.1 + 0.75 * 3, 5e-3);
  EXPECT_NEAR(score.accuracy_max * diagonal, 3, 1e-9);
  EXPECT_NEAR(score.completeness_max * diagonal, std::hypot(2, 0.1), 0.01);

  // Only what photos show counts for recall.
  const MeshScore visible =
      ScoreMesh(mesh, reference, {{1, 0.5, 0}, {1, 0.7, 0}}, {0.11 / diagonal}, Nearest::kSurface);
  EXPECT_EQ(visible.recall[0], 1);
  EXPECT_NEAR(visible.completeness * diagonal, 0.1, 1e-12);
  EXPECT_EQ(visible.precision[0], score.precision[1]);

  // Samples are no nearer than the surface, and where distances are small, some farther.
  const MeshScore samples = ScoreMesh(mesh, reference, {}, {0.11 / diagonal});
  EXPECT_NEAR(samples.precision[0], 0.25, 1e-3);
  EXPECT_LT(samples.recall[0], score.recall[1]);
  EXPECT_GT(samples.recall[0], score.recall[1] - 0.02);
  EXPECT_GT(samples.accuracy, score.accuracy);
  EXPECT_NEAR(ScoreMesh(mesh, mesh, {}, {1}, Nearest::kSurface).accuracy_max, 0, 1e-9);
  EXPECT_GT(ScoreMesh(mesh, mesh, {}, {1}).accuracy_max, 1e-3);
}

class MeshScoreFiles : public TemporaryFolderTest {
 protected:
  fs::path Write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  std::string Failure(const std::string& name, const std::string& text) const {
    try {
      ReadTriangleMesh(Write(name, text));
    } catch (const UserError& error) {
      EXPECT_THAT(error.what(), HasSubstr((folder_ / name).string()));
      return error.what();
    }
    return "";
  }
};

constexpr char kQuadObj[] =
    "# a quad, and a face with two neighbours on one side\nmtllib x.mtl\no quad\n"
    "v 500000.0625 0 0 1 0 0\nv 500001.0625 0 0 1 0 0\nv 500001.0625 1 0 1 0 0\n"
    "v 500000.0625 1 0 1 0 0\nvt 0 0\nvn 0 0 1\nusemtl red\n"
    "f 1/1/1 2/1/1 3/1/1 4/1/1\nf 1 2 -2\nf 1//1 2//1 3//1\n";

TEST_F(MeshScoreFiles, ReadsWhatOtherProgramsWrite) {
  // Doubles survive, and so do faces that are not manifold.
  const TriangleMesh obj = ReadTriangleMesh(Write("a.obj", kQuadObj));
  EXPECT_EQ(obj.vertices.size(), 4u);
  EXPECT_EQ(obj.vertices[0], Eigen::Vector3d(500000.0625, 0, 0));
  ASSERT_EQ(obj.triangles.size(), 4u);
  EXPECT_EQ(obj.triangles[1], (std::array<uint32_t, 3>{0, 2, 3}));
  EXPECT_EQ(obj.triangles[2], (std::array<uint32_t, 3>{0, 1, 2}));

  const TriangleMesh off =
      ReadTriangleMesh(Write("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 2 0\n3 0 1 2\n"));
  EXPECT_EQ(off.triangles.size(), 1u);
  EXPECT_EQ(off.vertices[2], Eigen::Vector3d(0, 2, 0));
  std::string binary = "OFF BINARY\n";
  const auto append = [&](uint32_t word) {
    for (const int shift : {24, 16, 8, 0}) binary += static_cast<char>(word >> shift);
  };
  for (const uint32_t count : {3, 1, 0}) append(count);
  for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 2.f, 0.f}) {
    append(std::bit_cast<uint32_t>(x));
  }
  for (const uint32_t corner : {3, 0, 1, 2, 0}) append(corner);  // and no colour
  for (const std::string& same :
       {binary,
        std::string("# made by hand\nOFF # 9 9 9\n# 8 8 8\n3 1 0\n0 0 0\n1 0 0\n0 2 0\n3 0 1 2\n"),
        std::string("OFF 3 1 0\n-0 0 0\n1 0 0\n0 2 0\n3 0 1 2\n"),
        std::string("NOFF\n3 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 2 0 0 0 1\n3 0 1 2\n")}) {
    const TriangleMesh spelt = ReadTriangleMesh(Write("b.off", same));
    EXPECT_EQ(spelt.vertices, off.vertices) << same;
    EXPECT_EQ(spelt.triangles, off.triangles) << same;
  }
  const TriangleMesh stl = ReadTriangleMesh(
      Write("a.STL",
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 2 0\n"
            "endloop\nendfacet\nendsolid a\n"));
  EXPECT_EQ(stl.triangles.size(), 1u);
  const std::string vertices =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\n";
  const TriangleMesh ply = ReadTriangleMesh(
      Write("a.ply",
            vertices + "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                       "0 0 0\n1 0 0\n0 2 0\n3 0 1 2\n"));
  EXPECT_EQ(ply.triangles.size(), 1u);
  const std::vector<Eigen::Vector3d> points =
      ReadPlyPoints(Write("points.ply", vertices + "end_header\n0 0 0\n1 0 0\n0 2 0\n"));
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[2], Eigen::Vector3d(0, 2, 0));
  EXPECT_EQ(ReadPlyPoints(folder_ / "a.ply"), points);
}

// What our own exporter writes is the same surface in every format.
TEST_F(MeshScoreFiles, ReadsOurOwn) {
  ExportableSceneOptions options;
  const ExportableScene scene = MakeExportableScene(TouchingBalls(500), options);
  ExportSurfaces(scene, folder_);
  const TriangleMesh om = ReadTriangleMesh(folder_ / "objects/7_mug.om");
  ASSERT_GT(om.triangles.size(), 50u);
  for (const char* other : {"objects/7_mug.ply", "objects/7_mug.obj"}) {
    const TriangleMesh mesh = ReadTriangleMesh(folder_ / other);
    EXPECT_EQ(mesh.vertices, om.vertices) << other;
    EXPECT_EQ(mesh.triangles, om.triangles) << other;
  }
}

TEST_F(MeshScoreFiles, WhatIsNoMeshIsOneSentence) {
  EXPECT_THAT(Failure("no.obj", "this is no mesh"), HasSubstr("cannot be read as a mesh"));
  EXPECT_THAT(Failure("no.om", "this is no mesh"), HasSubstr("is no OpenMesh file"));
  EXPECT_THAT(Failure("no.blend", "BLENDER"), HasSubstr("cannot be read as a mesh"));
  EXPECT_THAT(Failure("empty.ply", ""), HasSubstr("is no PLY file"));
  EXPECT_THAT(Failure("points.obj", "v 0 0 0\nv 1 0 0\n"), HasSubstr("no face with an area"));
  EXPECT_THAT(Failure("line.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n"),
              HasSubstr("no face with an area"));
  EXPECT_THAT(Failure("far.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"), HasSubstr("no vertex"));
  EXPECT_THAT(Failure("cut.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n"),
              HasSubstr("cannot be read as a mesh"));
  EXPECT_THROW(ReadTriangleMesh(folder_ / "missing.obj"), UserError);
  EXPECT_THROW(ReadTriangleMesh(folder_), UserError);
  EXPECT_THROW(ReadPlyPoints(folder_ / "missing.ply"), UserError);
  EXPECT_THROW(ReadPlyPoints(folder_ / "no.obj"), UserError);
}

TEST_F(MeshScoreFiles, PairsByName) {
  for (const char* file : {"meshes/7_mug.obj",
                           "meshes/7_mug.om",
                           "meshes/12_coffee_pot.ply",
                           "meshes/notes.txt",
                           "truth/mug.obj",
                           "truth/coffee pot.STL",
                           "truth/12.off",
                           "seen/mug.ply",
                           "seen/coffee_pot.ply"}) {
    Write(file, "x");
  }
  std::vector<MeshPair> pairs = PairMeshes(folder_ / "meshes", folder_ / "truth", {});
  ASSERT_EQ(pairs.size(), 3u);
  EXPECT_EQ(pairs[0].name, "12");
  EXPECT_EQ(pairs[0].mesh, fs::path()) << "an id alone is no name";
  EXPECT_EQ(pairs[1].name, "coffee pot");
  EXPECT_EQ(pairs[1].mesh, folder_ / "meshes/12_coffee_pot.ply");
  EXPECT_EQ(pairs[2].mesh, folder_ / "meshes/7_mug.om") << "the most exact format";
  EXPECT_EQ(pairs[2].visible, fs::path());
  pairs = PairMeshes(folder_ / "meshes", folder_ / "truth", folder_ / "seen");
  EXPECT_EQ(pairs[1].visible, folder_ / "seen/coffee_pot.ply");

  // One file finds its own in a folder; two are a pair.
  pairs = PairMeshes(folder_ / "meshes/7_mug.obj", folder_ / "truth", {});
  EXPECT_EQ(pairs[1].mesh, fs::path());
  EXPECT_EQ(pairs[2].mesh, folder_ / "meshes/7_mug.obj");
  pairs = PairMeshes(
      folder_ / "meshes/7_mug.obj", folder_ / "truth/12.off", folder_ / "seen/coffee_pot.ply");
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].mesh, folder_ / "meshes/7_mug.obj");
  EXPECT_EQ(pairs[0].visible, folder_ / "seen/coffee_pot.ply");

  const auto failure = [&](const char* meshes, const char* truth, const fs::path& seen) {
    try {
      PairMeshes(folder_ / meshes, folder_ / truth, seen);
    } catch (const UserError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(failure("missing", "truth", {}),
              AllOf(HasSubstr("no such file or folder for "), HasSubstr("mesh_path")));
  fs::create_directories(folder_ / "empty");
  EXPECT_THAT(failure("meshes", "empty", {}),
              AllOf(HasSubstr("has no files for "), HasSubstr("reference_path")));
  EXPECT_THAT(failure("meshes/12_coffee_pot.ply", "truth/../seen/", {}), testing::IsEmpty());
  Write("others/cat.obj", "x");
  EXPECT_THAT(
      failure("others", "truth", {}),
      AllOf(HasSubstr("it has cat, and "), HasSubstr("reference_path has 12, coffee pot, mug")));
  fs::remove(folder_ / "seen/mug.ply");
  EXPECT_THAT(failure("meshes", "truth", folder_ / "seen"),
              HasSubstr("has no points for the reference 'mug'; it has some for coffee_pot"));
}

// labels.json knows the true name of what a file's name only resembles.
TEST_F(MeshScoreFiles, PairsAsLabelsJsonSays) {
  Write("out/labels.json",
        R"({"objects": [{"id": 3, "name": "M\u00fctze", "files": {"ply": "objects/3_M_tze.ply"}},
            {"id": 4, "name": "gone", "files": {"ply": "objects/4_gone.ply"}},
            {"id": 5, "name": "odd", "files": []}, 6]})");
  Write("out/objects/3_M_tze.ply", "x");
  Write("truth/M\xC3\xBCtze.obj", "x");
  const std::vector<MeshPair> pairs = PairMeshes(folder_ / "out", folder_ / "truth", {});
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].mesh, folder_ / "out" / "objects/3_M_tze.ply");
}

}  // namespace
}  // namespace semfoam
