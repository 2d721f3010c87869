// SPDX-License-Identifier: GPL-3.0-or-later
//
// Bad PLY of Radiant Foam, meshes and lists of points.
#include "export/byte_writer.h"
#include "export/radiant_foam_ply.h"
#include "tools/mesh_distance.h"

#include <cstring>
#include <limits>

#include "tests/bad_input/bad_input.h"

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr size_t kSiteBytes = 3 * 4 + 3 + 4 + 4;

void WriteRadiantFoam(const fs::path& folder) {
  std::string ply = "ply\nformat binary_little_endian 1.0\nelement vertex 3\n";
  for (const char* name : {"float x",
                           "float y",
                           "float z",
                           "uchar red",
                           "uchar green",
                           "uchar blue",
                           "float density",
                           "uint adjacency_offset"}) {
    ply += std::string("property ") + name + "\n";
  }
  ply += "element adjacency 2\nproperty uint adjacency\nend_header\n";
  for (const float x : {0.f, 1.f, 2.f}) {
    for (const float value : {x, -x, 1.f}) AppendBinary(value, &ply);
    ply += "abc";
    AppendBinary(0.5f, &ply);
    AppendBinary(uint32_t{x > 0 ? 2u : 1u}, &ply);
  }
  AppendBinary(uint32_t{1}, &ply);
  AppendBinary(uint32_t{0}, &ply);
  WriteFile(folder / "a.ply", ply);
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

TEST(BadInput, RadiantFoam) {
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

TEST(BadInput, Meshes) {
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
  const std::vector<BadInput> points = {
      {"missing",
       Remove("a.ply"),
       "IN/a.ply: there is no such file, where a list of points should be."},
      {"a folder", MakeFolder("a.ply"), "IN/a.ply: is a folder, where a list of points should be."},
      {"a pipe", MakePipe("a.ply"), "IN/a.ply: is a pipe, where a list of points should be."},
      {"empty",
       Put("a.ply", ""),
       "IN/a.ply: is no list of points that can be read; a .ply file with vertices is needed."},
      {"2^60 points",
       Put("a.ply",
           "ply\nformat ascii 1.0\nelement vertex 1152921504606846976\nproperty double x\nproperty "
           "double y\nproperty double z\nend_header\n0 0 0\n"),
       "IN/a.ply: is no list of points that can be read; a .ply file with vertices is needed."},
      {"a property of no element",
       Put("a.ply", "ply\nformat ascii 1.0\nproperty double x\nend_header\n0 0 0\n"),
       "IN/a.ply: is no list of points that can be read; a .ply file with vertices is needed."},
      {"no points",
       Put("a.ply",
           "ply\nformat ascii 1.0\nelement vertex 0\nproperty double x\nproperty double "
           "y\nproperty double z\nend_header\n"),
       "IN/a.ply: is no list of points that can be read; a .ply file with vertices is needed."},
      {"nan",
       Put("a.ply",
           "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double "
           "y\nproperty double z\nend_header\nnan 0 0\n"),
       "IN/a.ply: is no list of points that can be read; a .ply file with vertices is needed."},
  };
  ExpectSentences(points, WriteRadiantFoam, [](const fs::path& f) { ReadPlyPoints(f / "a.ply"); });
}

}  // namespace
}  // namespace semfoam
