// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/mesh_files.h"

#include "export/io/surface_export.h"
#include "export/surface/clean_cells.h"
#include "export/surface/semantic_mesh.h"
#include "export/surface/smooth_surface.h"
#include "export/surface/surface_decimation.h"
#include "export/surface/surface_geometry.h"
#include "foam/util/error.h"

#include <cstring>
#include <fstream>
#include <random>
#include <set>
#include <sstream>

#include "tests/export/io/test_texture.h"
#include "tests/export/test_foams.h"
#include "tests/process_state.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace semfoam {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// A surface far from the origin, whose coordinates need every bit of a double.
ObjectSurface TestSurface() {
  Model model = TouchingBalls(1500);
  model.world_from_normalized = {1.0 / 3, {5e5, 4.5e6, 250}};
  const ExportableScene scene = MakeExportableScene(model);
  return ExtractSurface(scene, scene.objects[0]);
}

std::string ReadAll(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

template <typename T>
T Take(const std::string& bytes, size_t* at) {
  T value;
  EXPECT_LE(*at + sizeof(T), bytes.size());
  if (*at + sizeof(T) > bytes.size()) return T();
  std::memcpy(&value, bytes.data() + *at, sizeof(T));
  *at += sizeof(T);
  return value;
}

Color8 TakeColor(const std::string& bytes, size_t* at) {
  Color8 color;
  for (uint8_t& channel : color) channel = Take<uint8_t>(bytes, at);
  return color;
}

// The mesh's triangles, as vertex indices, in the order of its faces and beginning with the
// smallest: readers may turn them.
template <typename Mesh>
std::vector<std::array<uint32_t, 3>> Triangles(const Mesh& mesh) {
  std::vector<std::array<uint32_t, 3>> triangles;
  for (const auto face : mesh.faces()) {
    std::array<uint32_t, 3>& triangle = triangles.emplace_back();
    int k = 0;
    for (const auto vertex : mesh.fv_range(face)) triangle[k++] = vertex.idx();
    std::rotate(
        triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
  }
  return triangles;
}

std::vector<std::array<uint32_t, 3>> Turned(std::vector<std::array<uint32_t, 3>> triangles) {
  for (auto& t : triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return triangles;
}

template <typename Mesh>
void ExpectSameVertices(const Mesh& mesh, const ObjectSurface& surface, double tolerance) {
  ASSERT_EQ(mesh.n_vertices(), surface.vertices.size());
  double farthest = 0;
  for (size_t v = 0; v < surface.vertices.size(); ++v) {
    const auto& x = mesh.point(typename Mesh::VertexHandle(static_cast<int>(v)));
    farthest = std::max(farthest, (Eigen::Vector3d(x[0], x[1], x[2]) - surface.vertices[v]).norm());
  }
  EXPECT_LE(farthest, tolerance);
}

// The label, confidence and colour of every vertex, of the object 7.
void ExpectVertexProperties(const SemanticMesh& mesh, const ObjectSurface& surface) {
  OpenMesh::VPropHandleT<int> label;
  OpenMesh::VPropHandleT<float> confidence;
  ASSERT_TRUE(mesh.get_property_handle(label, kLabelProperty));
  ASSERT_TRUE(mesh.get_property_handle(confidence, kConfidenceProperty));
  for (const auto vertex : mesh.vertices()) {
    const size_t v = vertex.idx();
    EXPECT_EQ(mesh.property(label, vertex), 7);
    EXPECT_EQ(mesh.property(confidence, vertex), surface.vertex_confidence[v]);
    const auto& color = mesh.color(vertex);
    EXPECT_EQ((Color8{color[0], color[1], color[2]}), surface.vertex_color[v]);
  }
}

class MeshFiles : public TemporaryFolderTest {};

TEST_F(MeshFiles, PlyHoldsEveryBit) {
  const ObjectSurface surface = TestSurface();
  WritePly(folder_ / "mug.ply", surface);
  const std::string bytes = ReadAll(folder_ / "mug.ply");
  const std::string end = "end_header\n";
  size_t at = bytes.find(end);
  ASSERT_NE(at, std::string::npos);
  at += end.size();
  const std::string attributes =
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property int label\nproperty float confidence\n";
  EXPECT_EQ(bytes.substr(0, at),
            "ply\nformat binary_little_endian 1.0\ncomment object mug\ncomment label 7\n"
            "element vertex " +
                std::to_string(surface.vertices.size()) +
                "\nproperty double x\nproperty double y\nproperty double z\n" + attributes +
                "element face " + std::to_string(surface.triangles.size()) +
                "\nproperty list uchar int vertex_indices\n" + attributes + end);
  for (size_t v = 0; v < surface.vertices.size(); ++v) {
    Eigen::Vector3d x;
    for (double& coordinate : x) coordinate = Take<double>(bytes, &at);
    EXPECT_EQ(x, surface.vertices[v]);
    EXPECT_EQ(TakeColor(bytes, &at), surface.vertex_color[v]);
    EXPECT_EQ(Take<int32_t>(bytes, &at), 7);
    EXPECT_EQ(Take<float>(bytes, &at), surface.vertex_confidence[v]);
  }
  for (size_t f = 0; f < surface.triangles.size(); ++f) {
    EXPECT_EQ(Take<uint8_t>(bytes, &at), 3);
    for (const uint32_t vertex : surface.triangles[f]) {
      EXPECT_EQ(Take<int32_t>(bytes, &at), static_cast<int32_t>(vertex));
    }
    EXPECT_EQ(TakeColor(bytes, &at), surface.face_color[f]);
    EXPECT_EQ(Take<int32_t>(bytes, &at), 7);
    EXPECT_EQ(Take<float>(bytes, &at), surface.face_confidence[f]);
  }
  EXPECT_EQ(at, bytes.size());
}

TEST_F(MeshFiles, OpenMeshReadsThePly) {
  const ObjectSurface surface = TestSurface();
  WritePly(folder_ / "mug.ply", surface);
  SemanticMesh mesh;
  OpenMesh::IO::Options options = OpenMesh::IO::Options::VertexColor;
  options += OpenMesh::IO::Options::FaceColor;
  options += OpenMesh::IO::Options::Custom;
  ASSERT_TRUE(OpenMesh::IO::read_mesh(mesh, (folder_ / "mug.ply").string(), options));
  // OpenMesh's reader takes the doubles through float.
  ExpectSameVertices(mesh, surface, 0.5);
  EXPECT_EQ(Triangles(mesh), Turned(surface.triangles));
  ExpectVertexProperties(mesh, surface);
}

TEST_F(MeshFiles, OmBringsEverythingBack) {
  const ObjectSurface surface = TestSurface();
  WriteOm(folder_ / "mug.om", surface);
  SemanticMesh mesh;
  OpenMesh::IO::Options options = OpenMesh::IO::Options::VertexColor;
  options += OpenMesh::IO::Options::FaceColor;
  options += OpenMesh::IO::Options::Custom;
  ASSERT_TRUE(OpenMesh::IO::read_mesh(mesh, (folder_ / "mug.om").string(), options));
  ExpectSameVertices(mesh, surface, 0);
  EXPECT_EQ(Triangles(mesh), Turned(surface.triangles));

  // Nobody registers the properties before reading.
  OpenMesh::FPropHandleT<int> face_label;
  OpenMesh::FPropHandleT<float> face_confidence;
  OpenMesh::MPropHandleT<int> object_id;
  OpenMesh::MPropHandleT<std::string> object_name;
  ASSERT_TRUE(mesh.get_property_handle(face_label, kLabelProperty));
  ASSERT_TRUE(mesh.get_property_handle(face_confidence, kConfidenceProperty));
  ASSERT_TRUE(mesh.get_property_handle(object_id, kObjectIdProperty));
  ASSERT_TRUE(mesh.get_property_handle(object_name, kObjectNameProperty));
  EXPECT_EQ(mesh.property(object_id), 7);
  EXPECT_EQ(mesh.property(object_name), "mug");
  ExpectVertexProperties(mesh, surface);
  for (const auto face : mesh.faces()) {
    const size_t f = face.idx();
    EXPECT_EQ(mesh.property(face_label, face), 7);
    EXPECT_EQ(mesh.property(face_confidence, face), surface.face_confidence[f]);
    const auto& color = mesh.color(face);
    EXPECT_EQ((Color8{color[0], color[1], color[2]}), surface.face_color[f]);
  }
}

TEST_F(MeshFiles, ObjStandsAloneAndKeepsEveryBit) {
  const ObjectSurface surface = TestSurface();
  WriteObj(folder_ / "mug.obj", surface);
  std::ifstream in(folder_ / "mug.obj");
  std::vector<std::string> groups;
  size_t v = 0, f = 0;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      ASSERT_LT(v, surface.vertices.size());
      for (int a = 0; a < 3; ++a) {
        std::string number;
        words >> number;
        EXPECT_EQ(std::stod(number), surface.vertices[v][a]);
      }
      for (int c = 0; c < 3; ++c) {
        double channel;
        words >> channel;
        EXPECT_EQ(std::lround(255 * channel), surface.vertex_color[v][c]);
      }
      ++v;
    } else if (kind == "f") {
      ASSERT_LT(f, surface.triangles.size());
      for (const uint32_t vertex : surface.triangles[f]) {
        uint32_t index;
        words >> index;
        EXPECT_EQ(index, vertex + 1);
      }
      ++f;
    } else if (kind != "#") {
      groups.push_back(line);
      continue;
    }
    EXPECT_TRUE(words) << line;
  }
  EXPECT_EQ(v, surface.vertices.size());
  EXPECT_EQ(f, surface.triangles.size());
  EXPECT_THAT(groups, ElementsAre("mtllib 7_mug.mtl", "o 7_mug", "g 7_mug", "usemtl 7_mug"));
}

TEST_F(MeshFiles, OpenMeshReadsTheObj) {
  const ObjectSurface surface = TestSurface();
  WriteObj(folder_ / "mug.obj", surface);
  WriteMtl(folder_ / "7_mug.mtl", surface);
  SemanticMesh mesh;
  ASSERT_TRUE(OpenMesh::IO::read_mesh(mesh, (folder_ / "mug.obj").string()));
  EXPECT_EQ(Triangles(mesh), Turned(surface.triangles));
}

TEST_F(MeshFiles, ATexturedObjKeepsItsVerticesAndColours) {
  const ObjectSurface surface = TestSurface();
  const SurfaceTexture texture = TestTexture(surface);
  WriteObj(folder_ / "plain.obj", surface);
  WriteObj(folder_ / "mug.obj", surface, &texture);
  WriteMtl(folder_ / "7_mug.mtl", surface, "7_mug.png");
  std::istringstream lines(ReadAll(folder_ / "mug.obj"));
  std::string without;
  size_t coordinates = 0, faces = 0;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "vt") {
      float u, v;
      ASSERT_TRUE(words >> u >> v);
      EXPECT_EQ(u, texture.coordinates[coordinates].x());
      EXPECT_EQ(v, 1 - texture.coordinates[coordinates].y());
      ++coordinates;
      continue;
    }
    if (kind == "f") {
      line = "f";
      for (int k = 0; k < 3; ++k) {
        uint32_t vertex, coordinate;
        char slash;
        ASSERT_TRUE(words >> vertex >> slash >> coordinate);
        EXPECT_EQ(coordinate, texture.triangles[faces][k] + 1);
        line += " " + std::to_string(vertex);
      }
      ++faces;
    }
    without += line + "\n";
  }
  EXPECT_EQ(coordinates, texture.coordinates.size());
  EXPECT_EQ(without, ReadAll(folder_ / "plain.obj"));
  const std::string material = ReadAll(folder_ / "7_mug.mtl");
  EXPECT_NE(material.find("\nmap_Kd 7_mug.png\n"), std::string::npos) << material;
  EXPECT_NE(material.find("\nKd 1 1 1\n"), std::string::npos) << material;
  SemanticMesh mesh;
  ASSERT_TRUE(OpenMesh::IO::read_mesh(mesh, (folder_ / "mug.obj").string()));
  EXPECT_EQ(Triangles(mesh), Turned(surface.triangles));
}

TEST_F(MeshFiles, EveryUnitColourComesBack) {
  ObjectSurface surface = TestSurface();
  ASSERT_GE(surface.vertices.size(), 256u);
  for (int level = 0; level < 256; ++level) {
    const uint8_t channel = static_cast<uint8_t>(level);
    surface.vertex_color[level] = {channel, channel, channel};
  }
  WriteObj(folder_ / "mug.obj", surface);
  std::ifstream in(folder_ / "mug.obj");
  std::string line;
  for (int skipped = 0; skipped < 6; ++skipped) std::getline(in, line);
  for (int level = 0; level < 256; ++level) {
    std::getline(in, line);
    std::istringstream words(line);
    std::string v;
    double x, y, z, red;
    ASSERT_TRUE(words >> v >> x >> y >> z >> red);
    EXPECT_EQ(std::lround(255 * red), level);
  }
}

TEST_F(MeshFiles, NamesCannotBreakOutOfTheirLine) {
  ObjectSurface surface = TestSurface();
  surface.object_name = "a\nend_header\nv 0 0 0";
  WriteObj(folder_ / "a.obj", surface);
  WritePly(folder_ / "a.ply", surface);
  EXPECT_THAT(ReadAll(folder_ / "a.obj"), ::testing::StartsWith("# object a end_header v 0 0 0\n"));
  EXPECT_THAT(ReadAll(folder_ / "a.ply"),
              ::testing::HasSubstr("comment object a end_header v 0 0 0\n"));
}

TEST_F(MeshFiles, AFullDiskIsAUserErrorAndLeavesNothing) {
  const ObjectSurface surface = TestSurface();
  const ExportableScene scene = MakeExportableScene(TouchingBalls(800));
  SurfaceExportOptions only_glb;
  only_glb.om = only_glb.ply = only_glb.obj = only_glb.usda = false;
  SurfaceExportOptions only_usda;
  only_usda.om = only_usda.ply = only_usda.obj = only_usda.glb = false;
  {
    const FileSizeLimit limit(4096);
    EXPECT_THROW(WritePly(folder_ / "mug.ply", surface), UserError);
    EXPECT_THROW(WriteObj(folder_ / "mug.obj", surface), UserError);
    EXPECT_THROW(WriteOm(folder_ / "mug.om", surface), UserError);
    EXPECT_THROW(ExportSurfaces(scene, folder_, only_glb), UserError);
    EXPECT_THROW(ExportSurfaces(scene, folder_, only_usda), UserError);
  }
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) {
    EXPECT_TRUE(entry.is_directory()) << entry.path();
  }
}

TEST_F(MeshFiles, ExportWritesEveryFormatOfEveryObject) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls(800));
  std::vector<std::string> seen;
  const std::vector<WrittenFile> files = ExportSurfaces(
      scene, folder_, {}, [&](const WrittenFile& file) { seen.push_back(file.path); });
  EXPECT_THAT(seen,
              ElementsAre("objects/7_mug.om",
                          "objects/7_mug.ply",
                          "objects/7_mug.obj",
                          "objects/7_mug.mtl",
                          "objects/7_mug.glb",
                          "objects/8_label_8.om",
                          "objects/8_label_8.ply",
                          "objects/8_label_8.obj",
                          "objects/8_label_8.mtl",
                          "objects/8_label_8.glb",
                          "scene.glb",
                          "scene.usda"));
  ASSERT_EQ(files.size(), seen.size());
  for (const WrittenFile& file : files) {
    EXPECT_TRUE(std::filesystem::is_regular_file(folder_ / file.path)) << file.path;
    EXPECT_THAT(file.summary,
                ::testing::MatchesRegex(file.object_id == kNoObject
                                            ? "2 objects"
                                            : "[0-9]+ vertices, [0-9]+ faces, 1 shell, no "
                                              "cavities, genus 0.*"));
    EXPECT_EQ("." + file.format, std::filesystem::path(file.path).extension());
  }
}

TEST_F(MeshFiles, ExportWritesNoFormatButThoseAskedFor) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls(800));
  const std::vector<std::pair<bool SurfaceExportOptions::*, std::set<std::string>>> choices = {
      {&SurfaceExportOptions::om, {"objects/7_mug.om", "objects/8_label_8.om"}},
      {&SurfaceExportOptions::ply, {"objects/7_mug.ply", "objects/8_label_8.ply"}},
      {&SurfaceExportOptions::obj,
       {"objects/7_mug.obj",
        "objects/8_label_8.obj",
        "objects/7_mug.mtl",
        "objects/8_label_8.mtl"}},
      {&SurfaceExportOptions::glb, {"objects/7_mug.glb", "objects/8_label_8.glb", "scene.glb"}},
      {&SurfaceExportOptions::usda, {"scene.usda"}}};
  for (const auto& [chosen, expected] : choices) {
    SurfaceExportOptions options;
    options.om = options.ply = options.obj = options.glb = options.usda = false;
    options.*chosen = true;
    std::filesystem::remove_all(folder_);
    ExportSurfaces(scene, folder_, options);
    std::set<std::string> written;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) {
      if (entry.is_directory()) continue;
      written.insert(std::filesystem::relative(entry.path(), folder_).generic_string());
    }
    EXPECT_EQ(written, expected);
  }
}

TEST_F(MeshFiles, ExportOfSmoothSurfacesSaysHowFarTheyAreFromTheCells) {
  const ExportableScene scene = MakeExportableScene(TouchingBalls(800));
  SurfaceExportOptions options;
  options.method = SurfaceMethod::kSmooth;
  options.target_faces = 60;
  const std::vector<WrittenFile> files = ExportSurfaces(scene, folder_, options);
  ASSERT_EQ(files.size(), 12u);
  for (const WrittenFile& file : files) {
    EXPECT_TRUE(std::filesystem::is_regular_file(folder_ / file.path)) << file.path;
    if (file.object_id == kNoObject) continue;
    EXPECT_THAT(file.summary,
                ::testing::MatchesRegex(
                    "[0-9]+ vertices, (59|60) faces, 1 shell, no cavities, genus 0, from the cells "
                    "[0-9.e-]+ in the mean "
                    "\\([0-9.e-]+ % of the diagonal\\) and [0-9.e-]+ at most \\([0-9.e-]+ %\\), "
                    "Hausdorff distance [0-9.e-]+ \\([0-9.e-]+ %\\)"));
    EXPECT_EQ(file.warning, "");
  }
  SemanticMesh mesh;
  ASSERT_TRUE(OpenMesh::IO::read_mesh(mesh, (folder_ / "objects/7_mug.om").string()));
  EXPECT_LE(mesh.n_faces(), 60u);
  EXPECT_GE(mesh.n_faces(), 59u);
  // Fewer than there can be: a torus has at least 14 faces.
  options.target_faces = 12;
  for (const WrittenFile& file : ExportSurfaces(MakeExportableScene(Torus()), folder_, options)) {
    if (file.object_id == kNoObject) continue;
    EXPECT_THAT(file.warning, ::testing::MatchesRegex("[0-9]+ faces instead of 12, because .*"));
  }
}

TEST_F(MeshFiles, ExportCountsTheFacesThatADecimationMadeIntersect) {
  SurfaceExportOptions options;
  options.method = SurfaceMethod::kSmooth;
  options.target_faces = 100;
  bool has_crossing = false;
  for (unsigned seed = 1; seed <= 8 && !has_crossing; ++seed) {
    // Crumbs and tunnels in every direction.
    std::mt19937 random(seed);
    const ExportableScene scene =
        MakeExportableScene(MakeModel(RandomSites(2000, seed), 1, [&](const Eigen::Vector3f& p) {
          return p.norm() < 0.7f && random() % 2 == 0 ? 0 : kAir;
        }));
    ObjectInfo object = scene.objects[0];
    object.cells = FillPitsAndTunnels(scene, object.cells).cells;
    const ObjectSurface small =
        Decimate(ExtractSmoothSurface(scene, object, ExtractSurface(scene, object)), 100);
    const size_t crossing = SelfIntersections(small.vertices, small.triangles).size();
    has_crossing = crossing > 0;
    const std::string counted =
        has_crossing ? ", " + std::to_string(crossing) + " of which intersect" : "";
    EXPECT_THAT(ExportSurfaces(scene, folder_, options)[0].summary,
                ::testing::HasSubstr(" faces" + counted + ", 1 shell, no cavities, genus "));
  }
  EXPECT_TRUE(has_crossing);
}

TEST_F(MeshFiles, OptionsOutOfRangeAreNamed) {
  SurfaceExportOptions options;
  EXPECT_EQ(options.Check(), "");
  options.method = SurfaceMethod::kSmooth;
  EXPECT_EQ(options.Check(), "");
  for (const int64_t bad : {-1, 1, 3}) {
    options.target_faces = bad;
    EXPECT_THAT(options.Check(), ::testing::HasSubstr("target_faces must be at least 4"));
  }
  options.target_faces = 4;
  EXPECT_EQ(options.Check(), "");
  options.method = SurfaceMethod::kCells;
  EXPECT_THAT(options.Check(), ::testing::HasSubstr("target_faces needs the method smooth"));
}

TEST_F(MeshFiles, TheMaterialHasTheMeanColour) {
  ObjectSurface surface = TestSurface();
  surface.vertex_color = {{0, 255, 51}, {255, 255, 51}};
  WriteMtl(folder_ / "mug.mtl", surface);
  EXPECT_EQ(ReadAll(folder_ / "mug.mtl"),
            "# object mug\nnewmtl 7_mug\nKd 0.5 1 0.2\nKs 0 0 0\nillum 1\n");
}

// Facts of OpenMesh that our own writers stand on; when a new version changes them, look again.
TEST_F(MeshFiles, OpenMeshDropsOrBreaksWhatWeAvoid) {
  SemanticMesh mesh = ToSemanticMesh(TestSurface());
  OpenMesh::VPropHandleT<unsigned int> unsigned_property;
  mesh.add_property(unsigned_property, "unsigned");
  mesh.property(unsigned_property).set_persistent(true);
  OpenMesh::IO::Options options = OpenMesh::IO::Options::Binary;
  options += OpenMesh::IO::Options::Custom;
  ASSERT_TRUE(OpenMesh::IO::write_mesh(mesh, (folder_ / "unsigned.ply").string(), options));
  const std::string bytes = ReadAll(folder_ / "unsigned.ply");
  EXPECT_THAT(bytes.substr(0, 1000), ::testing::HasSubstr("property uint unsigned"));
  SemanticMesh back;
  OpenMesh::IO::Options read = OpenMesh::IO::Options::Custom;
  const bool sound = OpenMesh::IO::read_mesh(back, (folder_ / "unsigned.ply").string(), read) &&
                     back.n_faces() == mesh.n_faces();
  EXPECT_FALSE(sound) << "unsigned int properties have become safe";
}

}  // namespace
}  // namespace semfoam
