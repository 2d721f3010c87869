// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/obj_labels.h"

#include "export/io/byte_writer.h"
#include "export/scene/names.h"
#include "export/transfer/mesh_parts.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/number_text.h"

#include <algorithm>
#include <array>
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

// Takes the index before the next slash off the front of a corner; it counts from 1, or backwards
// from the last of `count` that there are so far.
uint32_t TakeIndex(std::string_view* corner, size_t count) {
  const std::string_view word = corner->substr(0, corner->find('/'));
  corner->remove_prefix(std::min(word.size() + 1, corner->size()));
  int64_t index = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), index);
  if (code != std::errc() || end != word.data() + word.size()) return kNoVertex;
  if (index < 0) index += static_cast<int64_t>(count) + 1;
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

// The kinds of what corners of faces refer to, in the order of their indices.
constexpr std::array<std::string_view, 3> kReferred = {"v", "vt", "vn"};

// The lines of an OBJ that its faces need.
struct ObjLines {
  // By kind: vertices, texture coordinates, normals.
  std::array<std::vector<std::string_view>, 3> referred;
  // The material libraries.
  std::vector<std::string_view> libraries;
  // What holds for the faces behind it, such as `usemtl`: keyword and line.
  std::vector<std::pair<std::string_view, std::string_view>> states;
  // [faces] How many of `states` stand before it.
  std::vector<size_t> states_before;
  // [corners] Their indices by kind; kNoVertex where a corner has none.
  std::vector<std::array<uint32_t, 3>> corners;
};

ObjLines FindLines(const fs::path& path, std::string_view bytes) {
  ObjLines lines;
  constexpr std::array<std::string_view, 4> kStates = {"usemtl", "s", "o", "mg"};
  ForEachLine(WithoutByteOrderMark(bytes), [&](std::string_view line, size_t number) {
    std::string_view rest = line;
    const std::string_view keyword = NextWord(&rest);
    for (size_t kind = 0; kind < kReferred.size(); ++kind) {
      if (keyword == kReferred[kind]) lines.referred[kind].push_back(line);
    }
    if (keyword == "mtllib") lines.libraries.push_back(line);
    if (std::find(kStates.begin(), kStates.end(), keyword) != kStates.end()) {
      lines.states.emplace_back(keyword, line);
    }
    if (keyword != "f") return;
    lines.states_before.push_back(lines.states.size());
    for (std::string_view word = NextWord(&rest); !word.empty() && word[0] != '#';
         word = NextWord(&rest)) {
      std::array<uint32_t, 3>& corner = lines.corners.emplace_back();
      for (size_t kind = 0; kind < kReferred.size(); ++kind) {
        const size_t count = lines.referred[kind].size();
        const bool is_given = !word.empty() && word[0] != '/';
        corner[kind] = TakeIndex(&word, count);
        if (is_given && corner[kind] >= count) {
          throw UserError(path.string(),
                          ": line ",
                          number,
                          " is a face with a corner at a `",
                          kReferred[kind],
                          "` that is not before it, of which there are ",
                          count,
                          "; is it damaged?");
        }
      }
    }
  });
  return lines;
}

// Ends a line that is the last of a file without a line break.
void WriteLine(std::string_view line, ByteWriter* out) {
  out->Text(line);
  if (!line.ends_with('\n')) out->Text("\n");
}

// Returns the line of a vertex at another place.
std::string MovedVertex(std::string_view line, const Eigen::Vector3d& x) {
  for (int word = 0; word < 4; ++word) NextWord(&line);
  std::string moved(1, 'v');
  for (const double coordinate : x) moved.append(" ").append(FormatNumber(coordinate));
  return moved.append(line);
}

// Copies the faces of a part and what they need.
void WritePart(const PolygonMesh& mesh,
               const ObjLines& lines,
               const MeshPart& part,
               const std::string& group,
               ByteWriter* out) {
  for (const std::string_view line : lines.libraries) WriteLine(line, out);
  std::array<std::vector<uint32_t>, 3> used;
  used[0] = part.vertices;
  for (const uint32_t f : part.faces) {
    for (uint64_t k = mesh.first_corner[f]; k < mesh.first_corner[f + 1]; ++k) {
      for (const size_t kind : {1, 2}) {
        if (lines.corners[k][kind] != kNoVertex) used[kind].push_back(lines.corners[k][kind]);
      }
    }
  }
  for (size_t kind = 0; kind < used.size(); ++kind) {
    std::sort(used[kind].begin(), used[kind].end());
    used[kind].erase(std::unique(used[kind].begin(), used[kind].end()), used[kind].end());
    for (const uint32_t index : used[kind]) WriteLine(lines.referred[kind][index], out);
    if (kind > 0) continue;
    for (size_t k = 0; k < part.centers.size(); ++k) {
      const uint32_t beside = part.vertices[part.beside_center[k]];
      WriteLine(MovedVertex(lines.referred[0][beside], part.centers[k]), out);
    }
  }
  out->Text("g " + group + "\n");
  size_t state = 0;
  for (const uint32_t f : part.faces) {
    // The last one of each kind.
    for (; state < lines.states_before[f]; ++state) {
      const auto begin = lines.states.begin() + static_cast<int64_t>(state) + 1;
      const auto end = lines.states.begin() + static_cast<int64_t>(lines.states_before[f]);
      const auto is_later = [&](const auto& other) {
        return other.first == lines.states[state].first;
      };
      if (std::none_of(begin, end, is_later)) WriteLine(lines.states[state].second, out);
    }
    std::string face = "f";
    for (uint64_t k = mesh.first_corner[f]; k < mesh.first_corner[f + 1]; ++k) {
      const std::array<uint32_t, 3>& corner = lines.corners[k];
      const auto append = [&](size_t kind) {
        if (corner[kind] == kNoVertex) return;
        const auto at = std::lower_bound(used[kind].begin(), used[kind].end(), corner[kind]);
        face += std::to_string(at - used[kind].begin() + 1);
      };
      face += " ";
      append(0);
      if (corner[1] != kNoVertex || corner[2] != kNoVertex) face += "/";
      append(1);
      if (corner[2] != kNoVertex) face += "/";
      append(2);
    }
    out->Text(face + "\n");
  }
  for (const auto& [a, b, c] : part.cap_triangles) {
    out->Text("f " + std::to_string(a + 1) + " " + std::to_string(b + 1) + " " +
              std::to_string(c + 1) + "\n");
  }
}

}  // namespace

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
        mesh.corners.push_back(TakeIndex(&word, mesh.vertices.size()));
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
    return FileStem(id, NameIn(labels, id));
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

void RequireSplittableObj(const fs::path& path) { FindLines(path, ReadFileBytes(path, kWhat)); }

std::vector<WrittenFile> SplitLabelledObj(const fs::path& input,
                                          const PolygonMesh& mesh,
                                          const fs::path& folder,
                                          const std::vector<Label>& labels,
                                          const std::vector<SurfaceLabel>& face_labels,
                                          bool cap) {
  const std::string bytes = ReadFileBytes(input, kWhat);
  const ObjLines lines = FindLines(input, bytes);
  CHECK_EQ(lines.states_before.size(), mesh.NumFaces());
  CHECK_EQ(lines.corners.size(), mesh.corners.size());
  const MeshParts split = FindMeshParts(face_labels);
  const std::vector<MeshPart> parts = TakeApart(mesh, split, cap);
  std::vector<WrittenFile> files = PartFiles(split, labels, "obj");
  for (size_t k = 0; k < parts.size(); ++k) {
    ByteWriter out(folder / files[k].path);
    WritePart(mesh, lines, parts[k], fs::path(files[k].path).stem().string(), &out);
    out.Finish();
    files[k].summary = PartSummary(parts[k].NumVertices(), parts[k].NumFaces(), parts[k].num_caps);
  }
  return files;
}

void CopyFiles(const std::vector<std::pair<fs::path, fs::path>>& from_and_to) {
  for (const auto& [from, to] : from_and_to) WriteTextFile(to, ReadFileBytes(from, "a file"));
}

}  // namespace semfoam
