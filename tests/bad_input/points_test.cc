// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bad PLY of Radiant Foam, meshes and lists of points.
#include "export/io/radiant_foam_ply.h"
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
      {"missing", Remove("a.ply"), "IN/a.ply: there is no such file, where a PLY file should be."},
      {"a folder", MakeFolder("a.ply"), "IN/a.ply: is a folder, where a PLY file should be."},
      {"a pipe", MakePipe("a.ply"), "IN/a.ply: is a pipe, where a PLY file should be."},
      {"a device", MakeDevice("a.ply"), "IN/a.ply: is a device, where a PLY file should be."},
      {"empty",
       CutTo("a.ply", 0),
       "IN/a.ply: is no PLY file: it does not begin with 'ply'; a binary PLY of points would be "
       "right."},
      {"cut header",
       CutTo("a.ply", 40),
       "IN/a.ply: is no whole PLY file: its header has no end_header; is the copy complete?"},
      {"cut site",
       CutTo("a.ply", 370),
       "IN/a.ply: has 20 bytes more than its header says; is it damaged?"},
      {"no PLY",
       header("ply\n", "png\n"),
       "IN/a.ply: is no PLY file: it does not begin with 'ply'; a binary PLY of points would be "
       "right."},
      {"text",
       header("binary_little_endian", "ascii"),
       "IN/a.ply: is a PLY of format ascii; binary_little_endian is what can be read."},
      {"the other end first",
       header("binary_little_endian", "binary_big_endian"),
       "IN/a.ply: is a PLY of format binary_big_endian; binary_little_endian is what can be read."},
      {"2^60 sites",
       header("vertex 3", "vertex 1152921504606846976"),
       "IN/a.ply: ends too early: its header says 1152921504606846976 of vertex, of which there "
       "are 3; is the copy complete?"},
      {"2^64 - 1 sites",
       header("vertex 3", "vertex 18446744073709551615"),
       "IN/a.ply: ends too early: its header says 18446744073709551615 of vertex, of which there "
       "are 3; is the copy complete?"},
      {"2^64 sites",
       header("vertex 3", "vertex 18446744073709551616"),
       "IN/a.ply: has a line in its header that is not understood, 'element vertex "
       "18446744073709551616'; 'element NAME COUNT', 'property TYPE NAME', each name once, would "
       "be right."},
      {"-1 sites",
       header("vertex 3", "vertex -1"),
       "IN/a.ply: has a line in its header that is not understood, 'element vertex -1'; 'element "
       "NAME COUNT', 'property TYPE NAME', each name once, would be right."},
      {"no sites",
       header("vertex 3", "vertices 3"),
       "IN/a.ply: has no sites; an element vertex with one at least would be right."},
      {"2 sites",
       header("vertex 3", "vertex 2"),
       "IN/a.ply: has 23 bytes more than its header says; is it damaged?"},
      {"element without count",
       header("vertex 3", "vertex"),
       "IN/a.ply: has a line in its header that is not understood, 'element vertex'; 'element NAME "
       "COUNT', 'property TYPE NAME', each name once, would be right."},
      {"unknown type",
       header("float x", "half x"),
       "IN/a.ply: has a line in its header that is not understood, 'property half x'; 'element "
       "NAME COUNT', 'property TYPE NAME', each name once, would be right."},
      {"property without name",
       header("float x", "float"),
       "IN/a.ply: has a line in its header that is not understood, 'property float'; 'element NAME "
       "COUNT', 'property TYPE NAME', each name once, would be right."},
      {"a list",
       header("uint adjacency\n", "list uchar uint adjacency\n"),
       "IN/a.ply: has lists (property list uchar uint adjacency); a file of points, not of faces, "
       "would be right."},
      {"same property twice",
       header("float y", "float x"),
       "IN/a.ply: has a line in its header that is not understood, 'property float x'; 'element "
       "NAME COUNT', 'property TYPE NAME', each name once, would be right."},
      {"same element twice",
       header("element adjacency", "element vertex"),
       "IN/a.ply: has a line in its header that is not understood, 'element vertex 2'; 'element "
       "NAME COUNT', 'property TYPE NAME', each name once, would be right."},
      {"no density",
       header("float density", "float opacity"),
       "IN/a.ply: has no property density of vertex, which should be there; is it of another "
       "program?"},
      {"no red",
       header("uchar red", "uchar rot"),
       "IN/a.ply: has no property red of vertex, which should be there; is it of another program?"},
      {"one coefficient",
       header("uint adjacency_offset", "uint adjacency_offset\nproperty char color_sh_0"),
       "IN/a.ply: ends too early: its header says 2 of adjacency, of which there are 1; is the "
       "copy complete?"},
      {"unknown line",
       header("element adjacency", "elements adjacency"),
       "IN/a.ply: has a line in its header that is not understood, 'elements adjacency 2'; "
       "'element NAME COUNT', 'property TYPE NAME', each name once, would be right."},
      {"bytes after the end",
       Append("a.ply", "xy"),
       "IN/a.ply: has 2 bytes more than its header says; is it damaged?"},
      {"position nan",
       FromEnd(8 + kSiteBytes, std::numeric_limits<float>::quiet_NaN()),
       "IN/a.ply: site 2 has a position that is not finite; is it damaged?"},
      {"position inf",
       FromEnd(8 + kSiteBytes, std::numeric_limits<float>::infinity()),
       "IN/a.ply: site 2 has a position that is not finite; is it damaged?"},
      {"density -1",
       FromEnd(8 + 8, -1.f),
       "IN/a.ply: site 2 has the density -1; finite and not negative would be right."},
      {"density nan",
       FromEnd(8 + 8, std::numeric_limits<float>::quiet_NaN()),
       "IN/a.ply: site 2 has the density nan; finite and not negative would be right."},
      {"offset of too many",
       FromEnd(8 + 4, 3u),
       "IN/a.ply: has 2 neighbours, while the last adjacency_offset is 3; both would be the same; "
       "is it damaged?"},
      {"offsets descend",
       FromEnd(8 + 4, 0u),
       "IN/a.ply: has adjacency_offsets that do not ascend; is it damaged?"},
      {"unknown neighbour",
       FromEnd(4, 3u),
       "IN/a.ply: names a neighbour 3 of 3 sites, of which the first is 0; is it damaged?"},
  };
  ExpectSentences(
      cases, WriteRadiantFoam, [](const fs::path& f) { ReadRadiantFoamPly(f / "a.ply"); });
}

TEST(Points, Meshes) {
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const auto put = [](const std::string& text) { return Put("a.obj", text); };
  const std::vector<BadInput> cases = {
      {"missing", Remove("a.obj"), "IN/a.obj: there is no such file, where a mesh should be."},
      {"a folder", MakeFolder("a.obj"), "IN/a.obj: is a folder, where a mesh should be."},
      {"a pipe", MakePipe("a.obj"), "IN/a.obj: is a pipe, where a mesh should be."},
      {"a device", MakeDevice("a.obj"), "IN/a.obj: is a device, where a mesh should be."},
      {"empty",
       put(""),
       "IN/a.obj: cannot be read as a mesh; .obj, .ply, .off, .stl and .om files can, where they "
       "are complete."},
      {"text",
       put("no mesh\n"),
       "IN/a.obj: cannot be read as a mesh; .obj, .ply, .off, .stl and .om files can, where they "
       "are complete."},
      {"no faces",
       put(vertices),
       "IN/a.obj: has no face with an area; a mesh with a surface is needed."},
      {"corner beyond the vertices",
       put(vertices + "f 1 2 4\n"),
       "IN/a.obj: a face has a corner that is no vertex of the file with finite coordinates; is it "
       "complete?"},
      {"corner of a word",
       put(vertices + "f 1 2 x\n"),
       "IN/a.obj: has no face with an area; a mesh with a surface is needed."},
      {"vertex nan",
       put("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
       "IN/a.obj: cannot be read as a mesh; .obj, .ply, .off, .stl and .om files can, where they "
       "are complete."},
      {"no area",
       put("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"),
       "IN/a.obj: has no face with an area; a mesh with a surface is needed."},
  };
  ExpectSentences(
      cases,
      [&](const fs::path& f) { WriteFile(f / "a.obj", vertices + "f 1 2 3\n"); },
      [](const fs::path& f) { ReadTriangleMesh(f / "a.obj"); });
  const std::string unreadable =
      ": cannot be read as a mesh; .obj, .ply, .off, .stl and .om files can, where they are "
      "complete.";
  const std::string rest = "0 0 0\n1 0 0\n0 1 0\n";
  const std::vector<BadInput> promising = {
      {"4e9 vertices", Put("a.off", "OFF\n4000000000 1 0\n" + rest + "3 0 1 2\n"), ""},
      {"2e9 vertices", Put("a.off", "OFF\n2000000000 1 0\n" + rest + "3 0 1 2\n"), ""},
      {"2e9 edges", Put("a.off", "OFF # 1\n# 2\n3 1 2000000000\n" + rest + "3 0 1 2\n"), ""},
      {"negative vertices", Put("a.off", "nOFF\n3 -2000000000 1 0\n" + rest + "3 0 1 2\n"), ""},
      {"2e9 vertices, binary",
       Put("a.off", std::string("OFF BINARY\n\x77\x35\x94\0\0\0\0\1\0\0\0\0", 23)),
       ""},
      {"a header cut short", Put("a.off", "OFF\n3 1"), ""},
      {"4e9 faces", Put("a.off", "OFF\n3 4000000000 0\n" + rest + "3 0 1 2\n"), ""},
      {"4e9 corners", Put("a.off", "OFF\n3 1 0\n" + rest + "4000000000 0 1 2\n"), ""},
  };
  for (BadInput bad : promising) {
    bad.sentence = "IN/a.off" + unreadable;
    ExpectSentences(
        {bad}, [](auto&) {}, [](const fs::path& f) { ReadTriangleMesh(f / "a.off"); });
  }
}

TEST(Points, MeshesInPly) {
  const auto put = [](const std::string& format, uint32_t corners) {
    return Put("a.ply", SmallPlyMesh(format, corners));
  };
  const auto change = [](const std::string& from, const std::string& to) {
    return Replace("a.ply", from, to);
  };
  const std::vector<BadInput> cases = {
      {"empty",
       Put("a.ply", ""),
       "IN/a.ply: is no PLY file: it does not begin with 'ply'; a PLY of points or faces would be "
       "right."},
      {"no format",
       change("format ascii 1.0\n", ""),
       "IN/a.ply: is a PLY of format none; ascii, binary_little_endian and binary_big_endian are "
       "what can be read."},
      {"another format",
       change("ascii", "utf8"),
       "IN/a.ply: is a PLY of format utf8; ascii, binary_little_endian and binary_big_endian are "
       "what can be read."},
      {"2^32 - 1 corners in text",
       put("ascii", 0xffffffff),
       "IN/a.ply: has a list of 4294967295 vertex_indices, of which at most 7 can follow; is it "
       "damaged?"},
      {"2^32 - 1 corners",
       put("binary_little_endian", 0xffffffff),
       "IN/a.ply: has a list of 4294967295 vertex_indices, of which at most 3 can follow; is it "
       "damaged?"},
      {"2^32 - 1 corners, the other end first",
       put("binary_big_endian", 0xffffffff),
       "IN/a.ply: has a list of 4294967295 vertex_indices, of which at most 3 can follow; is it "
       "damaged?"},
      {"4 corners of which there are 3",
       put("binary_little_endian", 4),
       "IN/a.ply: has a list of 4 vertex_indices, of which at most 3 can follow; is it damaged?"},
      {"-1 corners",
       change("\n3 0 1 2", "\n-1 0 1 2"),
       "IN/a.ply: has a list of -1 vertex_indices, of which at most 7 can follow; is it damaged?"},
      {"2.5 corners",
       change("\n3 0 1 2", "\n2.5 0 1 2"),
       "IN/a.ply: has a list of 2.5 vertex_indices, of which at most 7 can follow; is it damaged?"},
      {"a list of as many as a fraction says",
       change("list uint", "list float"),
       "IN/a.ply: has a line in its header that is not understood, 'property list float int "
       "vertex_indices'; 'element NAME COUNT', 'property TYPE NAME', each name once, would be "
       "right."},
      {"2^60 vertices",
       change("vertex 3", "vertex 1152921504606846976"),
       "IN/a.ply: ends too early: its header says 1152921504606846976 of vertex, of which there "
       "are "
       "4; is the copy complete?"},
      {"2^60 faces",
       change("face 1", "face 1152921504606846976"),
       "IN/a.ply: ends too early: its header says 1152921504606846976 of face, of which there are "
       "1; is the copy complete?"},
      {"a word",
       change("0 1 0", "0 one 0"),
       "IN/a.ply: has 'one' where a number should be, y of vertex; is it damaged?"},
      {"no height",
       change("float z", "float height"),
       "IN/a.ply: has no property z of vertex, which should be there; is it of another program?"},
      {"no corners",
       change("vertex_indices", "corners"),
       "IN/a.ply: has no list vertex_indices of face, which should be there; is it of another "
       "program?"},
      {"corners that are no list",
       change("list uint int", "int"),
       "IN/a.ply: has no list vertex_indices of face, which should be there; is it of another "
       "program?"},
      {"a corner beyond the vertices",
       change("0 1 2", "0 1 3"),
       "IN/a.ply: a face has a corner that is no vertex of the file with finite coordinates; is it "
       "complete?"},
      {"a corner before them",
       change("0 1 2", "0 1 -1"),
       "IN/a.ply: a face has a corner that is no vertex of the file with finite coordinates; is it "
       "complete?"},
      {"a corner between them",
       change("0 1 2", "0 1 1.5"),
       "IN/a.ply: a face has a corner that is no vertex of the file with finite coordinates; is it "
       "complete?"},
      {"a vertex without end",
       change("0 1 0", "0 1 inf"),
       "IN/a.ply: a face has a corner that is no vertex of the file with finite coordinates; is it "
       "complete?"},
      {"no faces",
       change("face 1", "face 0"),
       "IN/a.ply: has no face with an area; a mesh with a surface is needed."},
  };
  ExpectSentences(
      cases,
      [](const fs::path& f) { WriteFile(f / "a.ply", SmallPlyMesh("ascii")); },
      [](const fs::path& f) { ReadTriangleMesh(f / "a.ply"); });
}

TEST(Points, MeshesInOm) {
  const auto change = [](const std::string& from, const std::string& to) {
    return Replace("a.om", from, to);
  };
  const std::string not_closed =
      "IN/a.om: has a face whose edges do not close; is the file damaged?";
  const std::vector<BadInput> cases = {
      {"empty",
       Put("a.om", ""),
       "IN/a.om: is no OpenMesh file: it does not begin with 'OM'; an .om file of mesh_exporter's, "
       "or of OpenMesh's, would be right."},
      {"2^32 - 1 vertices",
       Put("a.om", SmallOmMesh(0xffffffff, 1, 3)),
       "IN/a.om: ends too early: its header says 4294967295 vertices, 1 faces and 3 edges; is the "
       "copy complete?"},
      {"2^32 - 1 faces",
       Put("a.om", SmallOmMesh(3, 0xffffffff, 3)),
       "IN/a.om: ends too early: its header says 3 vertices, 4294967295 faces and 3 edges; is the "
       "copy complete?"},
      {"2^32 - 1 edges",
       Put("a.om", SmallOmMesh(3, 1, 0xffffffff)),
       "IN/a.om: ends too early: its header says 3 vertices, 1 faces and 4294967295 edges; is the "
       "copy complete?"},
      {"cut",
       CutTo("a.om", 60),
       "IN/a.om: ends too early: its header says 3 vertices, 1 faces and 3 edges; is the copy "
       "complete?"},
      {"cut between its parts",
       CutTo("a.om", 16 + 2 + 72),
       "IN/a.om: ends too early: its header says 3 vertices, 1 faces and 3 edges; is the copy "
       "complete?"},
      {"a part of another kind",
       change(std::string("\x00\x56", 2), std::string("\xa0\x56", 2)),
       "IN/a.om: has a part that is not understood (entity 0, type 5); is the file damaged?"},
      {"positions in the plane",
       change(std::string("\x00\x56", 2), std::string("\x00\x4e", 2)),
       "IN/a.om: has a part that is not understood (entity 0, type 0); is the file damaged?"},
      {"edges in a circle beside the first",
       change(std::string("\x04\x02\x00", 3), std::string("\x02\x02\x00", 3)),
       not_closed},
      {"an edge that is none",
       change(std::string("\x04\x02\x00", 3), std::string("\x06\x02\x00", 3)),
       not_closed},
      {"a face without edges", change("\xe8\x06\x04", "\xe8\x06\xff"), not_closed},
      {"a corner beyond the vertices",
       change(std::string("\x04\x02\x00", 3), std::string("\x04\x03\x00", 3)),
       "IN/a.om: a face has a corner that is no vertex of the file with finite coordinates; is it "
       "complete?"},
      {"a corner before them",
       change(std::string("\x04\x02\x00", 3), std::string("\x04\xff\x00", 3)),
       "IN/a.om: a face has a corner that is no vertex of the file with finite coordinates; is it "
       "complete?"},
      {"a property longer than the file",
       change("int32_t\x0c", "int32_t\xff"),
       "IN/a.om: ends too early: its header says 3 vertices, 1 faces and 3 edges; is the copy "
       "complete?"},
  };
  ExpectSentences(
      cases,
      [](const fs::path& f) { WriteFile(f / "a.om", SmallOmMesh()); },
      [](const fs::path& f) { ReadTriangleMesh(f / "a.om"); });
}

TEST(Points, PointsInPly) {
  const std::vector<BadInput> points = {
      {"missing",
       Remove("a.ply"),
       "IN/a.ply: there is no such file, where a list of points should be."},
      {"a folder", MakeFolder("a.ply"), "IN/a.ply: is a folder, where a list of points should be."},
      {"a pipe", MakePipe("a.ply"), "IN/a.ply: is a pipe, where a list of points should be."},
      {"empty",
       Put("a.ply", ""),
       "IN/a.ply: is no PLY file: it does not begin with 'ply'; a PLY of points or faces would be "
       "right."},
      {"2^60 points",
       Put("a.ply",
           "ply\nformat ascii 1.0\nelement vertex 1152921504606846976\nproperty double x\nproperty "
           "double y\nproperty double z\nend_header\n0 0 0\n"),
       "IN/a.ply: ends too early: its header says 1152921504606846976 of vertex, of which there "
       "are "
       "1; is the copy complete?"},
      {"a property of no element",
       Put("a.ply", "ply\nformat ascii 1.0\nproperty double x\nend_header\n0 0 0\n"),
       "IN/a.ply: has a line in its header that is not understood, 'property double x'; 'element "
       "NAME COUNT', 'property TYPE NAME', each name once, would be right."},
      {"no points",
       Put("a.ply",
           "ply\nformat ascii 1.0\nelement vertex 0\nproperty double x\nproperty double "
           "y\nproperty double z\nend_header\n"),
       "IN/a.ply: is no list of points that can be read; a .ply file with vertices is needed, all "
       "of them with finite coordinates."},
      {"nan",
       Put("a.ply",
           "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double "
           "y\nproperty double z\nend_header\nnan 0 0\n"),
       "IN/a.ply: is no list of points that can be read; a .ply file with vertices is needed, all "
       "of them with finite coordinates."},
  };
  ExpectSentences(points, WriteRadiantFoam, [](const fs::path& f) { ReadPlyPoints(f / "a.ply"); });
}

}  // namespace
}  // namespace semfoam
