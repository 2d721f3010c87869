// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/label_transfer.h"

#include "export/io/label_sidecar.h"
#include "export/scene/names.h"
#include "export/transfer/face_votes.h"
#include "export/transfer/label_cut.h"
#include "export/transfer/matter_search.h"
#include "export/transfer/ply_labels.h"
#include "export/transfer/polygon_mesh.h"
#include "foam/util/error.h"
#include "foam/util/output_file.h"
#include "foam/util/parallel.h"
#include "foam/util/ply_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <sstream>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kBlock = 1024;
// Vertices of a mesh that are held against the foam before it is labelled.
constexpr size_t kMaxChecked = 5000;
// Of them, those whose distance to the matter is told.
constexpr size_t kMaxTold = 500;
constexpr double kSmoothnessOfResolution = 2;

// Counts the places that are far from all matter, and says what is odd about them.
class FrameCheck {
 public:
  FrameCheck(const MatterSearch& search, fs::path input)
      : search_(search), input_(std::move(input)) {}

  void Add(const Eigen::Vector3d& x, bool is_far) {
    if (!x.allFinite()) return;
    if (is_far) ++far_;
    // Every one at first, then every second, every fourth, ...
    if (looked_at_++ % stride_ == 0) {
      places_.push_back(x);
      if (places_.size() == 2 * kMaxTold) {
        for (size_t k = 0; k < kMaxTold; ++k) places_[k] = places_[2 * k];
        places_.resize(kMaxTold);
        stride_ *= 2;
      }
    }
  }

  int64_t far() const { return far_; }
  int64_t looked_at() const { return looked_at_; }

  // Throws UserError where most are far.
  void Require() const {
    if (looked_at_ == 0) {
      throw UserError(input_.string(), ": has no vertex with finite coordinates; is it damaged?");
    }
    if (2 * far_ <= looked_at_) return;
    std::vector<double> distances(places_.size());
    ParallelForBlocks(std::ssize(places_), 8, [&](int64_t begin, int64_t end) {
      for (int64_t k = begin; k < end; ++k) distances[k] = search_.DistanceToMatter(places_[k]);
    });
    const auto middle = distances.begin() + std::ssize(distances) / 2;
    std::nth_element(distances.begin(), middle, distances.end());
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& x : places_) mean += x / static_cast<double>(places_.size());
    std::ostringstream text;
    text.precision(3);
    text << ": " << 100 * far_ / looked_at_ << " % of its vertices are farther than "
         << search_.tolerance() << " from all matter of the foam, half of them farther than "
         << *middle << ", and their mean, " << Text(mean) << ", is off that of the matter, "
         << Text(search_.MiddleOfMatter()) << ", by " << (mean - search_.MiddleOfMatter()).norm();
    throw UserError(input_.string(),
                    text.str(),
                    "; give the similarity from the COLMAP frame to that of the file with ",
                    Field{"transform"},
                    ", or a larger ",
                    Field{"tolerance"},
                    ".");
  }

 private:
  static std::string Text(const Eigen::Vector3d& x) {
    std::ostringstream text;
    text.precision(6);
    text << "(" << x.x() << ", " << x.y() << ", " << x.z() << ")";
    return text.str();
  }

  const MatterSearch& search_;
  const fs::path input_;
  int64_t far_ = 0;
  int64_t looked_at_ = 0;
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

TransferredLabels TransferToCloud(const ExportableScene& scene,
                                  const MatterSearch& search,
                                  const fs::path& input,
                                  const fs::path& output,
                                  const TransferProgress& progress) {
  const auto num_points = static_cast<double>(NumVertices(input));
  FrameCheck check(search, input);
  LabelCount count;
  std::vector<uint8_t> is_far;
  const auto label = [&](const PlyBlock& block, std::span<SurfaceLabel> labels) {
    is_far.assign(labels.size(), 0);
    ParallelForBlocks(std::ssize(labels), kBlock, [&](int64_t begin, int64_t end) {
      uint32_t hint = 0;
      for (int64_t i = begin; i < end; ++i) {
        const Eigen::Vector3d normal = block.normals.empty()
                                           ? Eigen::Vector3d(0, 0, 0)
                                           : Eigen::Vector3d(block.normals[i].cast<double>());
        const MatterSearch::Found found = search.Find(block.positions[i], normal, &hint);
        labels[i] = search.LabelOf(found);
        is_far[i] = found.cell == kNoCell;
      }
    });
    for (size_t i = 0; i < labels.size(); ++i) {
      check.Add(block.positions[i], is_far[i]);
      count.AddVertex(block.positions[i], labels[i]);
    }
    progress("points labelled",
             static_cast<double>(block.first + labels.size()) / std::max(1.0, num_points));
  };
  CopyPlyWithLabels(
      input,
      output,
      scene.label_table,
      label,
      [](const PlyBlock&, std::span<SurfaceLabel>) {},
      [&] { check.Require(); });
  TransferredLabels result = count.Finish(scene.label_table);
  result.far = check.far();
  result.looked_at = check.looked_at();
  return result;
}

// Throws UserError where most of the mesh's vertices are far from all matter.
void CheckFrame(const PolygonMesh& mesh, const MatterSearch& search, FrameCheck* check) {
  const size_t stride = (mesh.vertices.size() + kMaxChecked - 1) / kMaxChecked;
  uint32_t hint = 0;
  for (size_t v = 0; v < mesh.vertices.size(); v += stride) {
    const MatterSearch::Found found = search.Find(mesh.vertices[v], Eigen::Vector3d::Zero(), &hint);
    check->Add(mesh.vertices[v], found.cell == kNoCell);
  }
  check->Require();
}

TransferredLabels TransferToMesh(const ExportableScene& scene,
                                 const MatterSearch& search,
                                 double smoothness,
                                 const fs::path& input,
                                 const fs::path& output,
                                 const TransferProgress& progress) {
  progress("reading", 0);
  const PolygonMesh mesh = ReadPolygonMesh(input);
  RequireValidMesh(input, mesh);
  FrameCheck check(search, input);
  CheckFrame(mesh, search, &check);

  progress("asking the foam", 0.2);
  const FaceVotes votes =
      CollectFaceVotes(mesh,
                       search.resolution(),
                       [&](const Eigen::Vector3d& normal,
                           std::span<const Eigen::Vector3d> places,
                           std::span<SurfaceLabel> labels,
                           uint32_t* hint) {
                         for (size_t k = 0; k < places.size(); ++k) {
                           labels[k] = search.LabelOf(search.Find(places[k], normal, hint));
                         }
                       });
  progress("cutting", 0.5);
  const std::vector<SurfaceLabel> face_labels = CutFaceLabels(
      mesh, votes, smoothness < 0 ? kSmoothnessOfResolution * search.resolution() : smoothness);
  std::vector<SurfaceLabel> vertex_labels = VertexLabels(mesh, face_labels);
  {
    // Vertices of no face are points.
    std::vector<uint8_t> has_face(mesh.vertices.size(), 0);
    for (const uint32_t corner : mesh.corners) has_face[corner] = 1;
    ParallelForBlocks(std::ssize(mesh.vertices), kBlock, [&](int64_t begin, int64_t end) {
      uint32_t hint = 0;
      for (int64_t v = begin; v < end; ++v) {
        if (has_face[v]) continue;
        const Eigen::Vector3d normal = mesh.normals.empty()
                                           ? Eigen::Vector3d(0, 0, 0)
                                           : Eigen::Vector3d(mesh.normals[v].cast<double>());
        vertex_labels[v] = search.LabelOf(search.Find(mesh.vertices[v], normal, &hint));
      }
    });
  }
  progress("writing", 0.8);
  const auto take = [](const std::vector<SurfaceLabel>& from) {
    return [&from](const PlyBlock& block, std::span<SurfaceLabel> labels) {
      CHECK_LE(block.first + labels.size(), from.size());
      std::copy_n(from.begin() + static_cast<int64_t>(block.first), labels.size(), labels.begin());
    };
  };
  CopyPlyWithLabels(input, output, scene.label_table, take(vertex_labels), take(face_labels));
  LabelCount count;
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    count.AddVertex(mesh.vertices[v], vertex_labels[v]);
  }
  for (size_t f = 0; f < mesh.NumFaces(); ++f) {
    count.AddFace(mesh.FaceArea(f).norm(), face_labels[f]);
  }
  TransferredLabels result = count.Finish(scene.label_table);
  result.far = check.far();
  result.looked_at = check.looked_at();
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

TransferredLabels TransferLabels(const ExportableScene& scene,
                                 const fs::path& input,
                                 const fs::path& output,
                                 const LabelTransferOptions& options,
                                 const TransferProgress& progress) {
  const MatterSearch search(scene, options.tolerance);
  TransferredLabels result =
      HasFaces(input) ? TransferToMesh(scene, search, options.smoothness, input, output, progress)
                      : TransferToCloud(scene, search, input, output, progress);
  result.tolerance = search.tolerance();
  return result;
}

void WriteTransferSidecar(const fs::path& path,
                          const ExportableScene& scene,
                          const TransferredLabels& transferred,
                          const std::string& file,
                          const std::string& source_checksum) {
  using Json = nlohmann::ordered_json;
  const auto triple = [](const Eigen::Vector3d& x) { return Json::array({x.x(), x.y(), x.z()}); };
  Json json = Json::parse(LabelTableJson(scene.label_table));
  if (!source_checksum.empty()) json[kSourceModelKey] = source_checksum;
  int64_t labelled = 0;
  for (const TransferredLabel& label : transferred.labels) {
    if (label.id != kNoObject) labelled += label.vertices;
  }
  json["transfer"] = {{"file", file},
                      {"vertices", transferred.vertices},
                      {"faces", transferred.faces},
                      {"labelled_vertices", labelled},
                      {"tolerance", transferred.tolerance}};
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
    json["objects"].push_back(object);
  }
  WriteTextFile(path, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace semfoam
