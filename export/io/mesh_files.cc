// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/mesh_files.h"

#include "export/io/byte_writer.h"
#include "export/scene/names.h"

#include <cmath>
#include <limits>
#include <string>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

void WriteColor(const Color8& color, ByteWriter* out) {
  for (const uint8_t channel : color) out->Binary(channel);
}

// 0..255 as 0..1 with the four digits that bring it back.
double UnitColor(double channel) { return std::round(channel / 255.0 * 1e4) / 1e4; }

}  // namespace

void WritePly(const fs::path& path, const ObjectSurface& surface) {
  CHECK_LE(surface.vertices.size(), static_cast<size_t>(std::numeric_limits<int32_t>::max()));
  ByteWriter out(path);
  out.Text("ply\nformat binary_little_endian 1.0\n");
  out.Text("comment object " + OneLine(surface.object_name) + "\n");
  out.Text("comment label " + std::to_string(Value(surface.object_id)) + "\n");
  out.Text("element vertex " + std::to_string(surface.vertices.size()) + "\n");
  out.Text("property double x\nproperty double y\nproperty double z\n");
  const char* attributes =
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property int label\nproperty float confidence\n";
  out.Text(attributes);
  out.Text("element face " + std::to_string(surface.triangles.size()) + "\n");
  out.Text("property list uchar int vertex_indices\n");
  out.Text(attributes);
  out.Text("end_header\n");
  for (size_t v = 0; v < surface.vertices.size(); ++v) {
    for (const double coordinate : surface.vertices[v]) out.Binary(coordinate);
    WriteColor(surface.vertex_color[v], &out);
    out.Binary(Value(surface.object_id));
    out.Binary(surface.vertex_confidence[v]);
  }
  for (size_t f = 0; f < surface.triangles.size(); ++f) {
    out.Binary(uint8_t{3});
    for (const uint32_t vertex : surface.triangles[f]) out.Binary(static_cast<int32_t>(vertex));
    WriteColor(surface.face_color[f], &out);
    out.Binary(Value(surface.object_id));
    out.Binary(surface.face_confidence[f]);
  }
  out.Finish();
}

void WriteObj(const fs::path& path, const ObjectSurface& surface, const SurfaceTexture* texture) {
  const std::string name = FileStem(surface.object_id, surface.object_name);
  ByteWriter out(path);
  out.Text("# object " + OneLine(surface.object_name) + "\n");
  out.Text("# label " + std::to_string(Value(surface.object_id)) + "\n");
  out.Text("mtllib " + name + ".mtl\no " + name + "\ng " + name + "\nusemtl " + name + "\n");
  for (size_t v = 0; v < surface.vertices.size(); ++v) {
    out.Text("v");
    for (const double coordinate : surface.vertices[v]) {
      out.Text(" ");
      out.Number(coordinate);
    }
    for (const uint8_t channel : surface.vertex_color[v]) {
      out.Text(" ");
      out.Number(UnitColor(channel));
    }
    out.Text("\n");
  }
  if (texture != nullptr) {
    for (const Eigen::Vector2f& coordinates : texture->coordinates) {
      out.Text("vt ");
      out.Number(coordinates.x());
      out.Text(" ");
      out.Number(1 - coordinates.y());  // from the lower left corner
      out.Text("\n");
    }
  }
  for (size_t f = 0; f < surface.triangles.size(); ++f) {
    out.Text("f");
    for (int k = 0; k < 3; ++k) {
      out.Text(" ");
      out.Number(uint64_t{surface.triangles[f][k]} + 1);
      if (texture == nullptr) continue;
      out.Text("/");
      out.Number(uint64_t{texture->triangles[f][k]} + 1);
    }
    out.Text("\n");
  }
  out.Finish();
}

void WriteMtl(const fs::path& path, const ObjectSurface& surface, const std::string& texture_name) {
  std::array<int64_t, 3> sums = {};
  for (const Color8& color : surface.vertex_color) {
    for (int c = 0; c < 3; ++c) sums[c] += color[c];
  }
  const int64_t count = std::max<int64_t>(1, surface.vertex_color.size());
  ByteWriter out(path);
  out.Text("# object " + OneLine(surface.object_name) + "\n");
  out.Text("newmtl " + FileStem(surface.object_id, surface.object_name) + "\n");
  out.Text("Kd");
  for (const int64_t sum : sums) {
    out.Text(" ");
    // Programs multiply the texture by it.
    out.Number(texture_name.empty()
                   ? UnitColor(static_cast<double>(sum) / static_cast<double>(count))
                   : 1.0);
  }
  out.Text("\nKs 0 0 0\nillum 1\n");
  if (!texture_name.empty()) out.Text("map_Kd " + texture_name + "\n");
  out.Finish();
}

}  // namespace semfoam
