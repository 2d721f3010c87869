// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/mesh_files.h"

#include "export/names.h"
#include "foam/error.h"
#include "foam/output_file.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <fstream>
#include <limits>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little);

// Collects bytes and hands them to the file in large pieces.
class ByteWriter {
 public:
  explicit ByteWriter(const fs::path& path) : out_(path, std::ios::binary) {}

  void Text(std::string_view text) {
    bytes_.append(text);
    if (bytes_.size() >= kPiece) Flush();
  }

  template <typename T>
  void Binary(const T& value) {
    static_assert(std::is_arithmetic_v<T>);
    const size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(&bytes_[at], &value, sizeof(T));
    if (bytes_.size() >= kPiece) Flush();
  }

  void Color(const Color8& color) {
    for (const uint8_t channel : color) Binary(channel);
  }

  // The shortest digits that read back as the same number.
  void Number(double value) {
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof(digits), value).ptr;
    Text({digits, end});
  }

  void Number(uint64_t value) {
    char digits[24];
    const auto end = std::to_chars(digits, digits + sizeof(digits), value).ptr;
    Text({digits, end});
  }

  // True when every byte went out.
  bool Finish() {
    Flush();
    out_.close();
    return !out_.fail();
  }

 private:
  static constexpr size_t kPiece = 1 << 20;

  void Flush() {
    out_.write(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
    bytes_.clear();
  }

  std::ofstream out_;
  std::string bytes_;
};

// A name goes into a one-line comment; a line break in it would end the comment.
std::string OneLine(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return text;
}

template <typename Body>
void WriteMeshFile(const fs::path& path, const Body& body) {
  OutputFile file(path);
  ByteWriter out(file.temporary_path());
  body(&out);
  if (!out.Finish()) {
    throw UserError(path.string(), ": cannot be written completely; is the disk full?");
  }
  file.Commit();
}

// 0..255 as 0..1 with the four digits that bring it back.
double UnitColor(uint8_t channel) { return std::round(channel / 255.0 * 1e4) / 1e4; }

}  // namespace

void WritePly(const fs::path& path, const ObjectSurface& surface) {
  CHECK_LE(surface.vertices.size(), static_cast<size_t>(std::numeric_limits<int32_t>::max()));
  WriteMeshFile(path, [&](ByteWriter* out) {
    out->Text("ply\nformat binary_little_endian 1.0\n");
    out->Text("comment object " + OneLine(surface.object_name) + "\n");
    out->Text("comment label " + std::to_string(surface.object_id) + "\n");
    out->Text("element vertex " + std::to_string(surface.vertices.size()) + "\n");
    out->Text("property double x\nproperty double y\nproperty double z\n");
    const char* attributes =
        "property uchar red\nproperty uchar green\nproperty uchar blue\n"
        "property int label\nproperty float confidence\n";
    out->Text(attributes);
    out->Text("element face " + std::to_string(surface.triangles.size()) + "\n");
    out->Text("property list uchar int vertex_indices\n");
    out->Text(attributes);
    out->Text("end_header\n");
    for (size_t v = 0; v < surface.vertices.size(); ++v) {
      for (const double coordinate : surface.vertices[v]) out->Binary(coordinate);
      out->Color(surface.vertex_color[v]);
      out->Binary(surface.object_id);
      out->Binary(surface.vertex_confidence[v]);
    }
    for (size_t f = 0; f < surface.triangles.size(); ++f) {
      out->Binary(uint8_t{3});
      for (const uint32_t vertex : surface.triangles[f]) out->Binary(static_cast<int32_t>(vertex));
      out->Color(surface.face_color[f]);
      out->Binary(surface.object_id);
      out->Binary(surface.face_confidence[f]);
    }
  });
}

void WriteObj(const fs::path& path, const ObjectSurface& surface) {
  const std::string name = FileStem(surface.object_id, surface.object_name);
  WriteMeshFile(path, [&](ByteWriter* out) {
    out->Text("# object " + OneLine(surface.object_name) + "\n");
    out->Text("# label " + std::to_string(surface.object_id) + "\n");
    out->Text("o " + name + "\ng " + name + "\n");
    for (size_t v = 0; v < surface.vertices.size(); ++v) {
      out->Text("v");
      for (const double coordinate : surface.vertices[v]) {
        out->Text(" ");
        out->Number(coordinate);
      }
      for (const uint8_t channel : surface.vertex_color[v]) {
        out->Text(" ");
        out->Number(UnitColor(channel));
      }
      out->Text("\n");
    }
    for (const auto& triangle : surface.triangles) {
      out->Text("f");
      for (const uint32_t vertex : triangle) {
        out->Text(" ");
        out->Number(uint64_t{vertex} + 1);
      }
      out->Text("\n");
    }
  });
}

}  // namespace semfoam
