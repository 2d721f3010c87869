// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bad PLY of Radiant Foam, meshes and lists of points.
#include "export/io/radiant_foam_ply.h"
#include "plugin/colmap/seed_cloud.h"
#include "tools/evaluation/mesh_distance.h"

#include <cstring>
#include <limits>

#include "tests/bad_input/bad_input.h"
#include "tests/small_files.h"

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr size_t kSiteBytes = 3 * 4 + 3 + 4 + 4;

void WriteRadiantFoam(const fs::path& folder) {
  WriteFile(folder / "a.ply", SmallRadiantFoam("3", 0));
}

// A spoiler: a value in the data, `back` bytes before the end.
template <typename T>
auto FromEnd(size_t back, T value) {
  return [=](const fs::path& folder) {
    std::string bytes = ReadFile(folder / "a.ply");
    std::memcpy(&bytes[bytes.size() - back], &value, sizeof(value));
    WriteFile(folder / "a.ply", bytes);
  };
}

TEST(Points, RadiantFoam) {
  const auto header = [](const std::string& from, const std::string& to) {
    return Replace("a.ply", from, to);
  };
  const std::vector<BadInput> cases = {
      {"missing", Remove("a.ply"), {"IN/a.ply", {}, "no such file"}},
      {"a folder", MakeFolder("a.ply"), {"IN/a.ply", {}, "is a folder"}},
      {"a pipe", MakePipe("a.ply"), {"IN/a.ply", {}, "is a pipe"}},
      {"a device", MakeDevice("a.ply"), {"IN/a.ply", {}, "is a device"}},
      {"empty", CutTo("a.ply", 0), {"IN/a.ply", {}, "is no PLY file"}},
      {"cut header", CutTo("a.ply", 40), {"IN/a.ply", {"end_header"}, "no whole PLY file"}},
      {"cut site", CutTo("a.ply", 370), {"IN/a.ply", {"header"}, "20 bytes more"}},
      {"no PLY", header("ply\n", "png\n"), {"IN/a.ply", {}, "is no PLY file"}},
      {"text",
       header("binary_little_endian", "ascii"),
       {"IN/a.ply", {"format ascii"}, "what can be read"}},
      {"the other end first",
       header("binary_little_endian", "binary_big_endian"),
       {"IN/a.ply", {"format binary_big_endian"}, "what can be read"}},
      {"2^60 sites",
       header("vertex 3", "vertex 1152921504606846976"),
       {"IN/a.ply", {"1152921504606846976 of vertex", "3"}, "ends too early"}},
      {"2^64 - 1 sites",
       header("vertex 3", "vertex 18446744073709551615"),
       {"IN/a.ply", {"18446744073709551615 of vertex", "3"}, "ends too early"}},
      {"2^64 sites",
       header("vertex 3", "vertex 18446744073709551616"),
       {"IN/a.ply", {"'element vertex 18446744073709551616'"}, "not understood"}},
      {"-1 sites",
       header("vertex 3", "vertex -1"),
       {"IN/a.ply", {"'element vertex -1'"}, "not understood"}},
      {"no sites", header("vertex 3", "vertices 3"), {"IN/a.ply", {"vertex"}, "has no sites"}},
      {"2 sites", header("vertex 3", "vertex 2"), {"IN/a.ply", {"header"}, "23 bytes more"}},
      {"element without count",
       header("vertex 3", "vertex"),
       {"IN/a.ply", {"'element vertex'"}, "not understood"}},
      {"unknown type",
       header("float x", "half x"),
       {"IN/a.ply", {"'property half x'"}, "not understood"}},
      {"property without name",
       header("float x", "float"),
       {"IN/a.ply", {"'property float'"}, "not understood"}},
      {"a list",
       header("uint adjacency\n", "list uchar uint adjacency\n"),
       {"IN/a.ply", {"property list uchar uint adjacency"}, "has lists"}},
      {"same property twice",
       header("float y", "float x"),
       {"IN/a.ply", {"'property float x'"}, "not understood"}},
      {"same element twice",
       header("element adjacency", "element vertex"),
       {"IN/a.ply", {"'element vertex 2'"}, "not understood"}},
      {"no density",
       header("float density", "float opacity"),
       {"IN/a.ply", {"density of vertex"}, "no property"}},
      {"no red", header("uchar red", "uchar rot"), {"IN/a.ply", {"red of vertex"}, "no property"}},
      {"one coefficient",
       header("uint adjacency_offset", "uint adjacency_offset\nproperty char color_sh_0"),
       {"IN/a.ply", {"2 of adjacency", "1"}, "ends too early"}},
      {"unknown line",
       header("element adjacency", "elements adjacency"),
       {"IN/a.ply", {"'elements adjacency 2'"}, "not understood"}},
      {"bytes after the end", Append("a.ply", "xy"), {"IN/a.ply", {"header"}, "2 bytes more"}},
      {"position nan",
       FromEnd(8 + kSiteBytes, std::numeric_limits<float>::quiet_NaN()),
       {"IN/a.ply", {"site 2", "position"}, "not finite"}},
      {"position inf",
       FromEnd(8 + kSiteBytes, std::numeric_limits<float>::infinity()),
       {"IN/a.ply", {"site 2", "position"}, "not finite"}},
      {"density -1",
       FromEnd(8 + 8, -1.f),
       {"IN/a.ply", {"site 2", "density -1"}, "finite and not negative"}},
      {"density nan",
       FromEnd(8 + 8, std::numeric_limits<float>::quiet_NaN()),
       {"IN/a.ply", {"site 2", "density nan"}, "finite and not negative"}},
      {"offset of too many",
       FromEnd(8 + 4, 3u),
       {"IN/a.ply", {"adjacency_offset", "3"}, "2 neighbours"}},
      {"offsets descend", FromEnd(8 + 4, 0u), {"IN/a.ply", {"adjacency_offsets"}, "do not ascend"}},
      {"unknown neighbour",
       FromEnd(4, 3u),
       {"IN/a.ply", {"neighbour 3", "3 sites"}, "names a neighbour"}},
  };
  ExpectMistakes(
      cases, WriteRadiantFoam, [](const fs::path& f) { ReadRadiantFoamPly(f / "a.ply"); });
}

TEST(Points, Meshes) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const auto put = [](const std::string& text) { return Put("a.obj", text); };
  const std::vector<BadInput> cases = {
      {"missing", Remove("a.obj"), {"IN/a.obj", {}, "no such file"}},
      {"a folder", MakeFolder("a.obj"), {"IN/a.obj", {}, "is a folder"}},
      {"a pipe", MakePipe("a.obj"), {"IN/a.obj", {}, "is a pipe"}},
      {"a device", MakeDevice("a.obj"), {"IN/a.obj", {}, "is a device"}},
      {"empty", put(""), {"IN/a.obj", {}, "cannot be read as a mesh"}},
      {"text", put("no mesh\n"), {"IN/a.obj", {}, "cannot be read as a mesh"}},
      {"no faces", put(vertices), {"IN/a.obj", {}, "no face with an area"}},
      {"corner beyond the vertices",
       put(vertices + "f 1 2 4\n"),
       {"IN/a.obj", {"corner"}, "no vertex"}},
      {"corner of a word", put(vertices + "f 1 2 x\n"), {"IN/a.obj", {}, "no face with an area"}},
      {"vertex nan",
       put("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
       {"IN/a.obj", {}, "cannot be read as a mesh"}},
      {"no area",
       put("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
       {"IN/a.obj", {}, "no face with an area"}},
  };
  ExpectMistakes(
      cases,
      [&](const fs::path& f) { WriteFile(f / "a.obj", vertices + "f 1 2 3\n"); },
      [](const fs::path& f) { ReadTriangleMesh(f / "a.obj"); });
  const std::string rest = "0 0 0\n1 0 0\n0 1 0\n";
  const Mistake unreadable = {"IN/a.off", {}, "cannot be read as a mesh"};
  const std::vector<BadInput> promising = {
      {"4e9 vertices", Put("a.off", "OFF\n4000000000 1 0\n" + rest + "3 0 1 2\n"), unreadable},
      {"2e9 vertices", Put("a.off", "OFF\n2000000000 1 0\n" + rest + "3 0 1 2\n"), unreadable},
      {"2e9 edges",
       Put("a.off", "OFF # 1\n# 2\n3 1 2000000000\n" + rest + "3 0 1 2\n"),
       unreadable},
      {"negative vertices",
       Put("a.off", "nOFF\n3 -2000000000 1 0\n" + rest + "3 0 1 2\n"),
       unreadable},
      {"2e9 vertices, binary",
       Put("a.off", std::string("OFF BINARY\n\x77\x35\x94\0\0\0\0\1\0\0\0\0", 23)),
       unreadable},
      {"a header cut short", Put("a.off", "OFF\n3 1"), unreadable},
      {"4e9 faces", Put("a.off", "OFF\n3 4000000000 0\n" + rest + "3 0 1 2\n"), unreadable},
      {"4e9 corners", Put("a.off", "OFF\n3 1 0\n" + rest + "4000000000 0 1 2\n"), unreadable},
  };
  ExpectMistakes(
      promising, [](auto&) {}, [](const fs::path& f) { ReadTriangleMesh(f / "a.off"); });
}

TEST(Points, MeshesInPly) {
  const auto put = [](const std::string& format, uint32_t corners) {
    return Put("a.ply", SmallPlyMesh(format, corners));
  };
  const auto change = [](const std::string& from, const std::string& to) {
    return Replace("a.ply", from, to);
  };
  const std::vector<BadInput> cases = {
      {"empty", Put("a.ply", ""), {"IN/a.ply", {}, "is no PLY file"}},
      {"no format",
       change("format ascii 1.0\n", ""),
       {"IN/a.ply", {"format none"}, "what can be read"}},
      {"another format",
       change("ascii", "utf8"),
       {"IN/a.ply", {"format utf8"}, "what can be read"}},
      {"2^32 - 1 corners in text",
       put("ascii", 0xffffffff),
       {"IN/a.ply", {"4294967295 vertex_indices"}, "at most 7"}},
      {"2^32 - 1 corners",
       put("binary_little_endian", 0xffffffff),
       {"IN/a.ply", {"4294967295 vertex_indices"}, "at most 3"}},
      {"2^32 - 1 corners, the other end first",
       put("binary_big_endian", 0xffffffff),
       {"IN/a.ply", {"4294967295 vertex_indices"}, "at most 3"}},
      {"4 corners of which there are 3",
       put("binary_little_endian", 4),
       {"IN/a.ply", {"4 vertex_indices"}, "at most 3"}},
      {"-1 corners",
       change("\n3 0 1 2", "\n-1 0 1 2"),
       {"IN/a.ply", {"-1 vertex_indices"}, "at most 7"}},
      {"2.5 corners",
       change("\n3 0 1 2", "\n2.5 0 1 2"),
       {"IN/a.ply", {"2.5 vertex_indices"}, "at most 7"}},
      {"a list of as many as a fraction says",
       change("list uint", "list float"),
       {"IN/a.ply", {"'property list float int vertex_indices'"}, "not understood"}},
      {"2^60 vertices",
       change("vertex 3", "vertex 1152921504606846976"),
       {"IN/a.ply", {"1152921504606846976 of vertex", "4"}, "ends too early"}},
      {"2^60 faces",
       change("face 1", "face 1152921504606846976"),
       {"IN/a.ply", {"1152921504606846976 of face", "1"}, "ends too early"}},
      {"a word",
       change("0 1 0", "0 one 0"),
       {"IN/a.ply", {"'one'", "y of vertex"}, "number should be"}},
      {"no height",
       change("float z", "float height"),
       {"IN/a.ply", {"z of vertex"}, "no property"}},
      {"no corners",
       change("vertex_indices", "corners"),
       {"IN/a.ply", {"vertex_indices of face"}, "has no list"}},
      {"corners that are no list",
       change("list uint int", "int"),
       {"IN/a.ply", {"vertex_indices of face"}, "has no list"}},
      {"a corner beyond the vertices",
       change("0 1 2", "0 1 3"),
       {"IN/a.ply", {"corner"}, "no vertex"}},
      {"a corner before them", change("0 1 2", "0 1 -1"), {"IN/a.ply", {"corner"}, "no vertex"}},
      {"a corner between them", change("0 1 2", "0 1 1.5"), {"IN/a.ply", {"corner"}, "no vertex"}},
      {"a vertex without end", change("0 1 0", "0 1 inf"), {"IN/a.ply", {"corner"}, "no vertex"}},
      {"no faces", change("face 1", "face 0"), {"IN/a.ply", {}, "no face with an area"}},
  };
  ExpectMistakes(
      cases,
      [](const fs::path& f) { WriteFile(f / "a.ply", SmallPlyMesh("ascii")); },
      [](const fs::path& f) { ReadTriangleMesh(f / "a.ply"); });
}

TEST(Points, MeshesInOm) {
  const auto change = [](const std::string& from, const std::string& to) {
    return Replace("a.om", from, to);
  };
  const Mistake not_closed = {"IN/a.om", {"face", "edges"}, "do not close"};
  const std::vector<BadInput> cases = {
      {"empty", Put("a.om", ""), {"IN/a.om", {}, "is no OpenMesh file"}},
      {"2^32 - 1 vertices",
       Put("a.om", SmallOmMesh(0xffffffff, 1, 3)),
       {"IN/a.om", {"4294967295 vertices", "1 faces", "3 edges"}, "ends too early"}},
      {"2^32 - 1 faces",
       Put("a.om", SmallOmMesh(3, 0xffffffff, 3)),
       {"IN/a.om", {"3 vertices", "4294967295 faces", "3 edges"}, "ends too early"}},
      {"2^32 - 1 edges",
       Put("a.om", SmallOmMesh(3, 1, 0xffffffff)),
       {"IN/a.om", {"3 vertices", "1 faces", "4294967295 edges"}, "ends too early"}},
      {"cut",
       CutTo("a.om", 60),
       {"IN/a.om", {"3 vertices", "1 faces", "3 edges"}, "ends too early"}},
      {"cut between its parts",
       CutTo("a.om", 16 + 2 + 72),
       {"IN/a.om", {"3 vertices", "1 faces", "3 edges"}, "ends too early"}},
      {"a part of another kind",
       change(std::string("\x00\x56", 2), std::string("\xa0\x56", 2)),
       {"IN/a.om", {"entity 0", "type 5"}, "not understood"}},
      {"positions in the plane",
       change(std::string("\x00\x56", 2), std::string("\x00\x4e", 2)),
       {"IN/a.om", {"entity 0", "type 0"}, "not understood"}},
      {"edges in a circle beside the first",
       change(std::string("\x04\x02\x00", 3), std::string("\x02\x02\x00", 3)),
       not_closed},
      {"an edge that is none",
       change(std::string("\x04\x02\x00", 3), std::string("\x06\x02\x00", 3)),
       not_closed},
      {"a face without edges", change("\xe8\x06\x04", "\xe8\x06\xff"), not_closed},
      {"a corner beyond the vertices",
       change(std::string("\x04\x02\x00", 3), std::string("\x04\x03\x00", 3)),
       {"IN/a.om", {"corner"}, "no vertex"}},
      {"a corner before them",
       change(std::string("\x04\x02\x00", 3), std::string("\x04\xff\x00", 3)),
       {"IN/a.om", {"corner"}, "no vertex"}},
      {"a property longer than the file",
       change("int32_t\x0c", "int32_t\xff"),
       {"IN/a.om", {"3 vertices", "1 faces", "3 edges"}, "ends too early"}},
  };
  ExpectMistakes(
      cases,
      [](const fs::path& f) { WriteFile(f / "a.om", SmallOmMesh()); },
      [](const fs::path& f) { ReadTriangleMesh(f / "a.om"); });
}

TEST(Points, PointsInPly) {
  const std::vector<BadInput> points = {
      {"missing", Remove("a.ply"), {"IN/a.ply", {}, "no such file"}},
      {"a folder", MakeFolder("a.ply"), {"IN/a.ply", {}, "is a folder"}},
      {"a pipe", MakePipe("a.ply"), {"IN/a.ply", {}, "is a pipe"}},
      {"empty", Put("a.ply", ""), {"IN/a.ply", {}, "is no PLY file"}},
      {"2^60 points",
       Put("a.ply",
           "ply\nformat ascii 1.0\nelement vertex 1152921504606846976\nproperty double x\nproperty "
           "double y\nproperty double z\nend_header\n0 0 0\n"),
       {"IN/a.ply", {"1152921504606846976 of vertex", "1"}, "ends too early"}},
      {"a property of no element",
       Put("a.ply", "ply\nformat ascii 1.0\nproperty double x\nend_header\n0 0 0\n"),
       {"IN/a.ply", {"'property double x'"}, "not understood"}},
      {"no points",
       Put("a.ply",
           "ply\nformat ascii 1.0\nelement vertex 0\nproperty double x\nproperty double "
           "y\nproperty double z\nend_header\n"),
       {"IN/a.ply", {}, "no list of points"}},
      {"nan",
       Put("a.ply",
           "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double "
           "y\nproperty double z\nend_header\nnan 0 0\n"),
       {"IN/a.ply", {}, "no list of points"}},
  };
  ExpectMistakes(points, WriteRadiantFoam, [](const fs::path& f) { ReadPlyPoints(f / "a.ply"); });
}

TEST(Points, SeedClouds) {
  const auto change = [](const std::string& from, const std::string& to) {
    return Replace("a.ply", from, to);
  };
  const auto points = [](const std::string& numbers) {
    return Put("a.ply",
               "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double "
               "y\nproperty double z\nend_header\n" +
                   numbers);
  };
  const std::vector<BadInput> cases = {
      {"missing", Remove("a.ply"), {"IN/a.ply", {}, "no such file"}},
      {"a folder", MakeFolder("a.ply"), {"IN/a.ply", {}, "is a folder"}},
      {"a pipe", MakePipe("a.ply"), {"IN/a.ply", {}, "is a pipe"}},
      {"a device", MakeDevice("a.ply"), {"IN/a.ply", {}, "is a device"}},
      {"empty", Put("a.ply", ""), {"IN/a.ply", {"'ply'"}, "is no PLY file"}},
      {"a photo", Put("a.ply", "\xff\xd8\xff"), {"IN/a.ply", {"'ply'"}, "is no PLY file"}},
      {"cut header", CutTo("a.ply", 60), {"IN/a.ply", {"end_header"}, "no whole PLY file"}},
      {"a header without end",
       Put("a.ply", "ply\nformat ascii 1.0\n" + std::string(100'000, '\n')),
       {"IN/a.ply", {"end_header"}, "no whole PLY file"}},
      {"no format", change("format ascii 1.0\n", ""), {"IN/a.ply", {"none"}, "what can be read"}},
      {"another format",
       change("ascii", "binary_middle_endian"),
       {"IN/a.ply", {"binary_middle_endian"}, "what can be read"}},
      {"unknown type",
       change("float x", "half x"),
       {"IN/a.ply", {"'property half x'"}, "not understood"}},
      {"2^60 points",
       change("vertex 3", "vertex 1152921504606846976"),
       {"IN/a.ply", {"1152921504606846976 of vertex"}, "ends too early"}},
      {"2^64 - 1 points",
       change("vertex 3", "vertex 18446744073709551615"),
       {"IN/a.ply", {"18446744073709551615 of vertex"}, "ends too early"}},
      {"-1 points",
       change("vertex 3", "vertex -1"),
       {"IN/a.ply", {"'element vertex -1'"}, "not understood"}},
      {"2^60 points of 1 GB each, in bytes",
       Put("a.ply", SmallCloud("binary_little_endian", "double", "1152921504606846976")),
       {"IN/a.ply", {"1152921504606846976 of vertex"}, "ends too early"}},
      {"cut points",
       Put("a.ply", SmallCloud("ascii").substr(0, 420)),
       {"IN/a.ply", {"3 of vertex", "2"}, "ends too early"}},
      {"cut points, in bytes",
       [](const fs::path& f) {
         const std::string bytes = SmallCloud("binary_big_endian");
         WriteFile(f / "a.ply", bytes.substr(0, bytes.size() - 41));
       },
       {"IN/a.ply", {"3 of vertex", "2"}, "ends too early"}},
      {"a cut face",
       [](const fs::path& f) {
         const std::string bytes = SmallCloud("binary_little_endian");
         WriteFile(f / "a.ply", bytes.substr(0, bytes.size() - 13));
       },
       {"IN/a.ply", {"1 of face", "0"}, "ends too early"}},
      {"a list longer than the file",
       change("255 0 0 0 0", "255 0 0 200 0"),
       {"IN/a.ply", {"200 view_indices"}, "can follow"}},
      {"no element of points",
       change("element vertex", "element splat"),
       {"IN/a.ply", {"vertex"}, "has no points"}},
      {"no points", change("vertex 3", "vertex 0"), {"IN/a.ply", {"vertex"}, "has no points"}},
      {"no x", change("float x", "float u"), {"IN/a.ply", {"x of vertex"}, "no property"}},
      {"no z", change("float z", "float w"), {"IN/a.ply", {"z of vertex"}, "no property"}},
      {"z as a list",
       change("float z", "list uchar float z"),
       {"IN/a.ply", {"z of vertex"}, "no property"}},
      {"a word",
       points("1 2 3\n1 two 3\n"),
       {"IN/a.ply", {"'two'", "y of vertex"}, "is it damaged"}},
      {"a long word",
       points("1 2 3\n" + std::string(600'000, '1') + " 2 3\n"),
       {"IN/a.ply", {"x of vertex"}, "where a number should be"}},
      {"nothing finite", points("nan 2 3\n1 inf 3\n"), {"IN/a.ply", {"2"}, "finite coordinates"}},
      {"all far away", points("nan 2 3\n1 1e9 3\n"), {"IN/a.ply", {"1 points"}, "lie far"}},
  };
  ExpectMistakes(
      cases,
      [](const fs::path& f) { WriteFile(f / "a.ply", SmallCloud("ascii")); },
      [](const fs::path& f) { ReadSeedCloud(f / "a.ply", {}, 100); });
}

}  // namespace
}  // namespace semfoam
