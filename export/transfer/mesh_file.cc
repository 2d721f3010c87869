// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/mesh_file.h"

#include "export/transfer/obj_labels.h"
#include "export/transfer/om_labels.h"
#include "export/transfer/ply_labels.h"
#include "export/transfer/ply_split.h"
#include "export/transfer/stl_labels.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr char kKinds[] = "PLY, OBJ, STL or OM";

class PlyMeshFile : public MeshFile {
 public:
  explicit PlyMeshFile(const fs::path& input) : input_(input), mesh_(ReadPolygonMesh(input)) {}

  const PolygonMesh& mesh() const override { return mesh_; }

  void Write(const fs::path& output,
             const std::vector<Label>& labels,
             const std::vector<SurfaceLabel>& vertex_labels,
             const std::vector<SurfaceLabel>& face_labels) const override {
    const auto take = [](const std::vector<SurfaceLabel>& from) {
      return [&from](const PlyBlock& block, std::span<SurfaceLabel> to) {
        CHECK_LE(block.first + to.size(), from.size());
        std::copy_n(from.begin() + static_cast<int64_t>(block.first), to.size(), to.begin());
      };
    };
    CopyPlyWithLabels(input_, output, labels, take(vertex_labels), take(face_labels));
  }

  std::vector<WrittenFile> Split(const fs::path& labelled,
                                 const std::vector<Label>& labels,
                                 const std::vector<SurfaceLabel>&,
                                 bool cap) const override {
    return SplitLabelledPly(labelled, labelled.parent_path(), labels, cap);
  }

 private:
  const fs::path input_;
  const PolygonMesh mesh_;
};

class ObjMeshFile : public MeshFile {
 public:
  ObjMeshFile(const fs::path& input, const fs::path& output, bool split)
      : input_(input),
        mesh_(ReadObjMesh(input)),
        materials_(ObjMaterialFiles(input, output.parent_path())) {
    if (!split) return;
    RequireSplittableObj(input);
    part_materials_ = ObjMaterialFiles(input, output.parent_path() / "objects");
  }

  const PolygonMesh& mesh() const override { return mesh_; }

  void Write(const fs::path& output,
             const std::vector<Label>& labels,
             const std::vector<SurfaceLabel>&,
             const std::vector<SurfaceLabel>& face_labels) const override {
    CopyFiles(materials_);
    CopyObjWithLabels(input_, output, labels, face_labels);
  }

  std::vector<WrittenFile> Split(const fs::path& labelled,
                                 const std::vector<Label>& labels,
                                 const std::vector<SurfaceLabel>& face_labels,
                                 bool cap) const override {
    CopyFiles(part_materials_);
    return SplitLabelledObj(input_, mesh_, labelled.parent_path(), labels, face_labels, cap);
  }

 private:
  const fs::path input_;
  const PolygonMesh mesh_;
  // Where they come from and go: beside the labelled file, and beside its parts.
  const std::vector<std::pair<fs::path, fs::path>> materials_;
  std::vector<std::pair<fs::path, fs::path>> part_materials_;
};

class StlMeshFile : public MeshFile {
 public:
  explicit StlMeshFile(const fs::path& input) : stl_(ReadStl(input)) {}

  const PolygonMesh& mesh() const override { return stl_.mesh; }

  void Write(const fs::path& output,
             const std::vector<Label>& labels,
             const std::vector<SurfaceLabel>& vertex_labels,
             const std::vector<SurfaceLabel>& face_labels) const override {
    WriteStlAsLabelledPly(stl_, output, labels, vertex_labels, face_labels);
  }

  std::vector<WrittenFile> Split(const fs::path& labelled,
                                 const std::vector<Label>& labels,
                                 const std::vector<SurfaceLabel>& face_labels,
                                 bool cap) const override {
    return SplitLabelledStl(stl_, labelled.parent_path(), labels, face_labels, cap);
  }

 private:
  const StlMesh stl_;
};

class OmMeshFile : public MeshFile {
 public:
  explicit OmMeshFile(const fs::path& input) : input_(input), mesh_(ReadOmPolygonMesh(input)) {}

  const PolygonMesh& mesh() const override { return mesh_; }

  void Write(const fs::path& output,
             const std::vector<Label>&,
             const std::vector<SurfaceLabel>& vertex_labels,
             const std::vector<SurfaceLabel>& face_labels) const override {
    CopyOmWithLabels(input_, output, vertex_labels, face_labels);
  }

  std::vector<WrittenFile> Split(const fs::path&,
                                 const std::vector<Label>&,
                                 const std::vector<SurfaceLabel>&,
                                 bool) const override {
    LOG(FATAL) << "RequireLabelledFormat refuses it";
  }

 private:
  const fs::path input_;
  const PolygonMesh mesh_;
};

std::string LowerExtension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) {
    return static_cast<char>(std::tolower(c));
  });
  return extension;
}

// Whether a text begins with a line that an OBJ may begin with, but for comments.
bool LooksLikeObj(std::string_view head) {
  head = WithoutByteOrderMark(head);
  while (!head.empty()) {
    const size_t begin = std::min(head.find_first_not_of(" \t\r\n"), head.size());
    head.remove_prefix(begin);
    const size_t end = std::min(head.find('\n'), head.size());
    if (!head.starts_with('#')) break;
    head.remove_prefix(end);
  }
  const std::string_view keyword = head.substr(0, std::min(head.find_first_of(" \t"), head.size()));
  constexpr std::array<std::string_view, 8> kKeywords = {
      "v", "vt", "vn", "f", "g", "o", "mtllib", "usemtl"};
  return std::find(kKeywords.begin(), kKeywords.end(), keyword) != kKeywords.end();
}

std::optional<MeshFormat> FormatOfName(const fs::path& path) {
  const std::string extension = LowerExtension(path);
  if (extension == ".ply") return MeshFormat::kPly;
  if (extension == ".obj") return MeshFormat::kObj;
  if (extension == ".stl") return MeshFormat::kStl;
  if (extension == ".om") return MeshFormat::kOm;
  return {};
}

}  // namespace

MeshFormat RecognizeMeshFormat(const fs::path& path) {
  const std::string what = std::string("a mesh or a point cloud (") + kKinds + ")";
  InputFile file(path, what);
  std::string head(4096, '\0');
  head.resize(file.Read(head.data(), head.size()));
  if (head.starts_with("ply\n") || head.starts_with("ply\r")) return MeshFormat::kPly;
  if (IsOm(head)) return MeshFormat::kOm;
  if (const auto format = FormatOfName(path)) return *format;
  if (IsStl(head, file.size())) return MeshFormat::kStl;
  if (LooksLikeObj(head)) return MeshFormat::kObj;
  throw UserError(path.string(), ": is no ", kKinds, "; ", what, " is needed.");
}

fs::path LabelledName(const fs::path& input, MeshFormat format) {
  fs::path name = input.filename();
  if (format == MeshFormat::kStl) name.replace_extension(".ply");
  return name;
}

void RequireLabelledFormat(const fs::path& input, const fs::path& output_path, bool split) {
  const MeshFormat format = RecognizeMeshFormat(input);
  switch (format) {
    case MeshFormat::kPly: {
      const PlyReader header(input, "a PLY of points or faces");
      return;
    }
    case MeshFormat::kObj:
      return;
    case MeshFormat::kOm:
      if (!split) return;
      throw UserError(input.string(),
                      ": is an OM; ",
                      Field{"split"},
                      " 1 writes parts of PLY, OBJ and STL files alone.");
    case MeshFormat::kStl:
      if (split || LowerExtension(output_path) != ".stl") return;
      throw UserError(
          output_path.string(),
          ": an STL has no place for labels; give a folder, for a PLY with labels, and ",
          Field{"split"},
          " 1 for an STL of each object.");
  }
}

std::unique_ptr<MeshFile> ReadMeshFile(const fs::path& input,
                                       MeshFormat format,
                                       const fs::path& output,
                                       bool split) {
  std::unique_ptr<MeshFile> file;
  switch (format) {
    case MeshFormat::kPly:
      file = std::make_unique<PlyMeshFile>(input);
      break;
    case MeshFormat::kObj:
      file = std::make_unique<ObjMeshFile>(input, output, split);
      break;
    case MeshFormat::kStl:
      file = std::make_unique<StlMeshFile>(input);
      break;
    case MeshFormat::kOm:
      file = std::make_unique<OmMeshFile>(input);
      break;
  }
  RequireValidMesh(input, file->mesh());
  return file;
}

}  // namespace semfoam
