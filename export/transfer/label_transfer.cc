// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/label_transfer.h"

#include "export/io/label_sidecar.h"
#include "export/scene/names.h"
#include "export/transfer/face_votes.h"
#include "export/transfer/label_cut.h"
#include "export/transfer/mesh_file.h"
#include "export/transfer/ply_labels.h"
#include "export/transfer/ply_split.h"
#include "export/transfer/polygon_mesh.h"
#include "foam/util/error.h"
#include "foam/util/output_file.h"
#include "foam/util/parallel.h"
#include "foam/util/ply_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <utility>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kBlock = 1024;
// Vertices of a mesh that the source is asked about before it is labelled.
constexpr size_t kMaxChecked = 5000;
// Places of which LabelSource::Why tells.
constexpr size_t kMaxTold = 500;
constexpr double kSmoothnessOfResolution = 2;

// Counts the places that the source does not know, and says what is odd about them.
class FrameCheck {
 public:
  FrameCheck(const LabelSource& source, fs::path input)
      : source_(source), input_(std::move(input)) {}

  void Add(const Eigen::Vector3d& x, bool is_known) {
    if (!x.allFinite()) return;
    if (!is_known) ++unknown_;
    // Every one at first, then every second, every fourth, ...
    if (asked_++ % stride_ != 0) return;
    places_.push_back(x);
    if (places_.size() < 2 * kMaxTold) return;
    for (size_t k = 0; k < kMaxTold; ++k) places_[k] = places_[2 * k];
    places_.resize(kMaxTold);
    stride_ *= 2;
  }

  // Throws UserError where it does not know most.
  void Require() const {
    if (asked_ == 0) {
      throw UserError(input_.string(), ": has no vertex with finite coordinates; is it damaged?");
    }
    if (2 * unknown_ <= asked_) return;
    const std::string share = std::to_string(100 * unknown_ / asked_) + " % of its vertices ";
    constexpr char kAdvice[] =
        "; give the similarity from the COLMAP frame to that of the file with ";
    if (source_.Tolerance() > 0) {
      throw UserError(input_.string(),
                      ": ",
                      share,
                      source_.Why(places_),
                      kAdvice,
                      Field{"transform"},
                      ", or a larger ",
                      Field{"tolerance"},
                      ".");
    }
    throw UserError(
        input_.string(), ": ", share, source_.Why(places_), kAdvice, Field{"transform"}, ".");
  }

  void Tell(TransferredLabels* result) const {
    result->unknown = unknown_;
    result->asked = asked_;
  }

 private:
  const LabelSource& source_;
  const fs::path input_;
  int64_t unknown_ = 0;
  int64_t asked_ = 0;
  int64_t stride_ = 1;
  std::vector<Eigen::Vector3d> places_;
};

// Adds up what has got which label.
class LabelCount {
 public:
  void AddVertex(const Eigen::Vector3d& x, const SurfaceLabel& label) {
    TransferredLabel& of = labels_[label.id];
    ++of.vertices;
    of.confidence += label.confidence;
    if (x.allFinite()) of.box.extend(x);
  }
  void AddFace(double area, const SurfaceLabel& label) {
    TransferredLabel& of = labels_[label.id];
    ++of.faces;
    if (std::isfinite(area)) of.area += area;
  }

  TransferredLabels Finish(const std::vector<Label>& table) const {
    TransferredLabels result;
    for (const auto& [id, of] : labels_) {
      TransferredLabel& label = result.labels.emplace_back(of);
      label.id = id;
      label.confidence /= static_cast<double>(std::max<int64_t>(1, of.vertices));
      for (const Label& named : table) {
        if (named.id == id && id != kNoObject) label.name = DisplayName(id, named.name);
      }
      result.vertices += label.vertices;
      result.faces += label.faces;
      result.area += label.area;
    }
    return result;
  }

 private:
  std::map<LabelId, TransferredLabel> labels_;
};

bool HasFaces(const fs::path& input) {
  const PlyReader reader(input, "a PLY of points or faces");
  const auto& elements = reader.header().elements;
  return std::any_of(elements.begin(), elements.end(), [](const PlyElement& element) {
    return IsPlyFaces(element) && element.count > 0;
  });
}

uint64_t NumVertices(const fs::path& input) {
  const PlyReader reader(input, "a PLY of points or faces");
  uint64_t count = 0;
  for (const PlyElement& element : reader.header().elements) {
    if (IsPlyVertices(element)) count += element.count;
  }
  if (count == 0) {
    throw UserError(input.string(), ": has no vertices; a mesh or a point cloud is needed.");
  }
  return count;
}

TransferredLabels TransferToCloud(LabelSource* source,
                                  const LabelTransferOptions& options,
                                  const fs::path& input,
                                  const fs::path& output,
                                  const TransferProgress& progress) {
  const auto num_points = static_cast<double>(NumVertices(input));
  if (source->NeedsWholeFile()) {
    progress("looking at the points", 0);
    source->LookAt(ReadPolygonMesh(input));
  }
  FrameCheck check(*source, input);
  LabelCount count;
  std::vector<uint8_t> is_known;
  const auto label = [&](const PlyBlock& block, std::span<SurfaceLabel> labels) {
    is_known.assign(labels.size(), 0);
    ParallelForBlocks(std::ssize(labels), kBlock, [&](int64_t begin, int64_t end) {
      uint32_t hint = 0;
      for (int64_t i = begin; i < end; ++i) {
        const Eigen::Vector3d normal = block.normals.empty()
                                           ? Eigen::Vector3d(0, 0, 0)
                                           : Eigen::Vector3d(block.normals[i].cast<double>());
        const LabelSource::Answer answer = source->Ask(block.positions[i], normal, &hint);
        labels[i] = answer.label;
        is_known[i] = answer.is_known;
      }
    });
    for (size_t i = 0; i < labels.size(); ++i) {
      check.Add(block.positions[i], is_known[i]);
      count.AddVertex(block.positions[i], labels[i]);
    }
    progress("points labelled", static_cast<double>(block.first + labels.size()) / num_points);
  };
  CopyPlyWithLabels(
      input,
      output,
      source->labels(),
      label,
      [](const PlyBlock&, std::span<SurfaceLabel>) {},
      [&] { check.Require(); });
  TransferredLabels result = count.Finish(source->labels());
  check.Tell(&result);
  if (options.split) {
    result.parts = SplitLabelledPly(output, output.parent_path(), source->labels());
  }
  return result;
}

// Throws UserError where the source does not know most of the mesh's vertices.
void CheckFrame(const PolygonMesh& mesh, const LabelSource& source, FrameCheck* check) {
  const size_t stride = (mesh.vertices.size() + kMaxChecked - 1) / kMaxChecked;
  uint32_t hint = 0;
  for (size_t v = 0; v < mesh.vertices.size(); v += stride) {
    check->Add(mesh.vertices[v],
               source.Ask(mesh.vertices[v], Eigen::Vector3d::Zero(), &hint).is_known);
  }
  check->Require();
}

// Vertices of no face are points.
void LabelLooseVertices(const PolygonMesh& mesh,
                        const LabelSource& source,
                        std::vector<SurfaceLabel>* labels) {
  std::vector<uint8_t> has_face(mesh.vertices.size(), 0);
  for (const uint32_t corner : mesh.corners) has_face[corner] = 1;
  ParallelForBlocks(std::ssize(mesh.vertices), kBlock, [&](int64_t begin, int64_t end) {
    uint32_t hint = 0;
    for (int64_t v = begin; v < end; ++v) {
      if (has_face[v]) continue;
      const Eigen::Vector3d normal = mesh.normals.empty()
                                         ? Eigen::Vector3d(0, 0, 0)
                                         : Eigen::Vector3d(mesh.normals[v].cast<double>());
      (*labels)[v] = source.Ask(mesh.vertices[v], normal, &hint).label;
    }
  });
}

TransferredLabels TransferToMesh(LabelSource* source,
                                 const LabelTransferOptions& options,
                                 const fs::path& input,
                                 MeshFormat format,
                                 const fs::path& output,
                                 const TransferProgress& progress) {
  progress("reading", 0);
  const std::unique_ptr<MeshFile> file = ReadMeshFile(input, format, output, options.split);
  const PolygonMesh& mesh = file->mesh();
  progress("looking at the mesh", 0.1);
  source->LookAt(mesh);
  FrameCheck check(*source, input);
  CheckFrame(mesh, *source, &check);

  progress("collecting votes", 0.2);
  const FaceVotes votes = CollectFaceVotes(mesh,
                                           source->Resolution(),
                                           source->UnknownIsUnlabelled(),
                                           [&](const Eigen::Vector3d& normal,
                                               std::span<const Eigen::Vector3d> places,
                                               std::span<SurfaceLabel> labels,
                                               uint32_t* hint) {
                                             for (size_t k = 0; k < places.size(); ++k) {
                                               labels[k] =
                                                   source->Ask(places[k], normal, hint).label;
                                             }
                                           });
  progress("cutting", 0.5);
  const double smoothness =
      options.smoothness < 0 ? kSmoothnessOfResolution * source->Resolution() : options.smoothness;
  const std::vector<SurfaceLabel> face_labels = CutFaceLabels(mesh, votes, smoothness);
  std::vector<SurfaceLabel> vertex_labels = VertexLabels(mesh, face_labels);
  LabelLooseVertices(mesh, *source, &vertex_labels);
  progress("writing", 0.8);
  file->Write(output, source->labels(), vertex_labels, face_labels);
  LabelCount count;
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    count.AddVertex(mesh.vertices[v], vertex_labels[v]);
  }
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    count.AddFace(mesh.FaceArea(f).norm(), face_labels[f]);
  }
  TransferredLabels result = count.Finish(source->labels());
  check.Tell(&result);
  if (options.split) {
    result.parts = file->Split(output, source->labels(), face_labels, options.cap);
  }
  return result;
}

}  // namespace

void LabelTransferOptions::RequireValid() const {
  if (!(tolerance >= 0)) {
    throw FieldError("tolerance", " is ", tolerance, "; it must be 0 or a length greater than 0.");
  }
  if (!(smoothness >= 0) && smoothness != -1) {
    throw FieldError(
        "smoothness", " is ", smoothness, "; it must be a length, 0 or -1, which chooses it.");
  }
}

TransferredLabels TransferLabels(LabelSource* source,
                                 const fs::path& input,
                                 const fs::path& output,
                                 const LabelTransferOptions& options,
                                 const TransferProgress& progress) {
  const MeshFormat format = RecognizeMeshFormat(input);
  if (format == MeshFormat::kPly && !HasFaces(input)) {
    return TransferToCloud(source, options, input, output, progress);
  }
  return TransferToMesh(source, options, input, format, output, progress);
}

void WriteTransferSidecar(const fs::path& path,
                          const LabelSource& source,
                          const TransferredLabels& transferred,
                          const std::string& file,
                          const std::string& source_checksum) {
  using Json = nlohmann::ordered_json;
  const auto triple = [](const Eigen::Vector3d& x) { return Json::array({x.x(), x.y(), x.z()}); };
  Json json = Json::parse(LabelTableJson(source.labels()));
  if (!source_checksum.empty()) json[kSourceModelKey] = source_checksum;
  int64_t labelled = 0;
  for (const TransferredLabel& label : transferred.labels) {
    if (label.id != kNoObject) labelled += label.vertices;
  }
  json["transfer"] = {{"file", file},
                      {"vertices", transferred.vertices},
                      {"faces", transferred.faces},
                      {"labelled_vertices", labelled}};
  if (source.Tolerance() > 0) json["transfer"]["tolerance"] = source.Tolerance();
  json["objects"] = Json::array();
  for (const TransferredLabel& label : transferred.labels) {
    if (label.id == kNoObject) continue;
    Json object = {{"id", Value(label.id)},
                   {"name", label.name},
                   {"color", LabelColor(label.id)},
                   {"vertices", label.vertices},
                   {"faces", label.faces},
                   {"area", label.area},
                   {"confidence", label.confidence}};
    if (!label.box.isEmpty()) {
      object["bounding_box"] = Json::array({triple(label.box.min()), triple(label.box.max())});
    }
    for (const WrittenFile& part : transferred.parts) {
      if (part.object_id == label.id) object["files"][part.format] = part.path;
    }
    json["objects"].push_back(object);
  }
  WriteTextFile(path, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace semfoam
