// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/obj_labels.h"

#include "export/io/byte_writer.h"
#include "export/scene/names.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <string>
#include <string_view>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr char kWhat[] = "an OBJ";
constexpr std::string_view kBlanks = " \t\r\n\v\f";

// Takes the next word off the front of a line; empty at its end. A backslash before a line's break
// is a blank.
std::string_view NextWord(std::string_view* line) {
  while (true) {
    const size_t begin = std::min(line->find_first_not_of(kBlanks), line->size());
    const size_t end = std::min(line->find_first_of(kBlanks, begin), line->size());
    const std::string_view word = line->substr(begin, end - begin);
    line->remove_prefix(end);
    if (word != "\\") return word;
  }
}

std::string_view Trimmed(std::string_view text) {
  const size_t begin = std::min(text.find_first_not_of(kBlanks), text.size());
  return text.substr(begin, text.find_last_not_of(kBlanks) + 1 - begin);
}

// Calls `take(line, number)` with each line and its line break; a line that ends with a backslash
// and the next are one.
template <typename Take>
void ForEachLine(std::string_view bytes, const Take& take) {
  size_t number = 0;
  for (size_t begin = 0; begin < bytes.size();) {
    const size_t first_number = ++number;
    size_t end = std::min(bytes.find('\n', begin), bytes.size() - 1) + 1;
    const auto continues = [&] {
      size_t last = end - 1;
      if (bytes[last] != '\n') return false;
      if (last > begin && bytes[last - 1] == '\r') --last;
      return last > begin && bytes[last - 1] == '\\';
    };
    while (end < bytes.size() && continues()) {
      end = std::min(bytes.find('\n', end), bytes.size() - 1) + 1;
      ++number;
    }
    take(bytes.substr(begin, end - begin), first_number);
    begin = end;
  }
}

Eigen::Vector3d ParseVertex(std::string_view line, const fs::path& path, size_t number) {
  Eigen::Vector3d vertex;
  for (double& coordinate : vertex) {
    std::string_view word = NextWord(&line);
    if (word.starts_with('+')) word.remove_prefix(1);
    const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), coordinate);
    if (code != std::errc() || end != word.data() + word.size() || word.empty()) {
      throw UserError(path.string(),
                      ": line ",
                      number,
                      " is a vertex without three numbers; is it damaged, or no OBJ?");
    }
  }
  return vertex;
}

// The index before the first slash.
uint32_t ParseCorner(std::string_view word, size_t num_vertices) {
  word = word.substr(0, word.find('/'));
  int64_t index = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), index);
  if (code != std::errc() || end != word.data() + word.size()) return kNoVertex;
  if (index < 0) index += static_cast<int64_t>(num_vertices) + 1;
  return index >= 1 && index < kNoVertex ? static_cast<uint32_t>(index - 1) : kNoVertex;
}

bool IsTexture(std::string_view keyword) {
  std::string lower(keyword);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower.starts_with("map_") || lower == "bump" || lower == "disp" || lower == "decal" ||
         lower == "refl" || lower == "norm";
}

// Appends a file that a line names, if it is there and stays below its folder.
void AddFile(const fs::path& from_folder,
             const fs::path& to_folder,
             std::string_view name,
             std::vector<std::pair<fs::path, fs::path>>* files) {
  const fs::path relative = fs::path(std::string(name)).lexically_normal();
  if (relative.empty() || relative.is_absolute() || *relative.begin() == "..") return;
  const fs::path from = from_folder / relative, to = to_folder / relative;
  std::error_code error;
  if (!fs::is_regular_file(from, error)) return;
  const auto is_same = [&](const auto& file) { return file.second == to; };
  if (std::any_of(files->begin(), files->end(), is_same)) return;
  if (fs::exists(to) &&
      (!fs::is_regular_file(to) || ReadFileBytes(to, "a file") != ReadFileBytes(from, "a file"))) {
    throw UserError(to.string(),
                    ": differs from ",
                    from.string(),
                    ", which belongs beside the labelled file; give another folder or move it.");
  }
  files->emplace_back(from, to);
}

}  // namespace

bool IsObjName(const fs::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".obj" || extension == ".OBJ";
}

PolygonMesh ReadObjMesh(const fs::path& path) {
  const std::string bytes = ReadFileBytes(path, kWhat);
  PolygonMesh mesh;
  ForEachLine(WithoutByteOrderMark(bytes), [&](std::string_view line, size_t number) {
    const std::string_view keyword = NextWord(&line);
    if (keyword == "v") {
      mesh.vertices.push_back(ParseVertex(line, path, number));
    } else if (keyword == "f") {
      for (std::string_view word = NextWord(&line); !word.empty() && word[0] != '#';
           word = NextWord(&line)) {
        mesh.corners.push_back(ParseCorner(word, mesh.vertices.size()));
      }
      if (mesh.corners.size() < mesh.first_corner.back() + 3) {
        throw UserError(path.string(),
                        ": line ",
                        number,
                        " is a face of fewer than three corners; is it damaged, or no OBJ?");
      }
      mesh.first_corner.push_back(mesh.corners.size());
    }
  });
  if (mesh.NumFaces() == 0) {
    throw UserError(path.string(),
                    ": has no faces; an OBJ must be a mesh, clouds are read as PLY.");
  }
  return mesh;
}

void CopyObjWithLabels(const fs::path& input,
                       const fs::path& output,
                       const std::vector<Label>& labels,
                       std::span<const SurfaceLabel> face_labels) {
  const auto group_of = [&](LabelId id) -> std::string {
    if (id == kNoObject) return "unlabelled";
    const auto label = std::find_if(
        labels.begin(), labels.end(), [&](const Label& other) { return other.id == id; });
    return FileStem(id, label == labels.end() ? "" : label->name);
  };
  const std::string bytes = ReadFileBytes(input, kWhat);
  ByteWriter out(output);
  size_t face = 0;
  ForEachLine(bytes, [&](std::string_view line, size_t) {
    std::string_view rest = face == 0 ? WithoutByteOrderMark(line) : line;
    const std::string_view keyword = NextWord(&rest);
    if (keyword == "g") return;
    if (keyword == "f") {
      CHECK_LT(face, face_labels.size());
      const LabelId id = face_labels[face].id;
      if (face == 0 || id != face_labels[face - 1].id) out.Text("g " + group_of(id) + "\n");
      ++face;
    }
    out.Text(line);
  });
  CHECK_EQ(face, face_labels.size());
  out.Finish();
}

std::vector<std::pair<fs::path, fs::path>> ObjMaterialFiles(const fs::path& obj,
                                                            const fs::path& folder) {
  std::vector<std::pair<fs::path, fs::path>> files;
  const std::string bytes = ReadFileBytes(obj, kWhat);
  ForEachLine(bytes, [&](std::string_view line, size_t) {
    if (NextWord(&line) == "mtllib") AddFile(obj.parent_path(), folder, Trimmed(line), &files);
  });
  const size_t libraries = files.size();
  for (size_t k = 0; k < libraries; ++k) {
    const auto [from, to] = files[k];
    const std::string library = ReadFileBytes(from, "a material library");
    ForEachLine(library, [&](std::string_view line, size_t) {
      if (!IsTexture(NextWord(&line))) return;
      // The name is the rest of the line, or, behind options, its last word.
      const std::string_view name = Trimmed(line);
      AddFile(from.parent_path(), to.parent_path(), name, &files);
      AddFile(from.parent_path(),
              to.parent_path(),
              name.substr(name.find_last_of(kBlanks) + 1),
              &files);
    });
  }
  return files;
}

void CopyFiles(const std::vector<std::pair<fs::path, fs::path>>& from_and_to) {
  for (const auto& [from, to] : from_and_to) WriteTextFile(to, ReadFileBytes(from, "a file"));
}

}  // namespace semfoam
