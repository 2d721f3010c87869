// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/mesh_distance.h"

#include <map>
#include <string>

#include "tests/fuzz/fuzz_input.h"

// Meshes and points as mesh_evaluator takes them; the first byte of an input is the format. CGAL
// reads .obj, .off and .stl, whose code is not instrumented but for its templates.
namespace semfoam {

const double kLargestBlockPerByte = 1000;

namespace {

class NamedFile {
 public:
  NamedFile() {
    std::string name = (std::filesystem::temp_directory_path() / "semfoam fuzz XXXXXX").string();
    Require(::mkdtemp(name.data()) != nullptr, "there is a temporary folder");
    folder_ = name;
    for (const auto& [key, extension] : kExtensions) {
      std::filesystem::create_symlink(file_.path(), folder_ / ("a" + extension));
    }
  }
  ~NamedFile() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }

  std::filesystem::path With(char key, std::string_view bytes) const {
    file_.Set(bytes);
    const auto found = kExtensions.find(key);
    return folder_ / ("a" + (found == kExtensions.end() ? ".ply" : found->second));
  }

 private:
  inline static const std::map<char, std::string> kExtensions = {
      {'p', ".ply"}, {'o', ".obj"}, {'f', ".off"}, {'s', ".stl"}, {'m', ".om"}};
  std::filesystem::path folder_;
  MemoryFile file_;
};

}  // namespace
}  // namespace semfoam

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const semfoam::NamedFile file;
  if (size == 0) return 0;
  const char format = static_cast<char>(data[0]);
  const auto path = file.With(format, {reinterpret_cast<const char*>(data) + 1, size - 1});
  semfoam::ReadsOrRefuses(path, [&] {
    if (format == 'P') {
      semfoam::ReadPlyPoints(path);
      return;
    }
    const semfoam::TriangleMesh mesh = semfoam::ReadTriangleMesh(path);
    for (const auto& triangle : mesh.triangles) {
      for (const uint32_t corner : triangle) {
        semfoam::Require(corner < mesh.vertices.size(), "a corner is a vertex");
      }
    }
  });
  return 0;
}
