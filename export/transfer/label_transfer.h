// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/util/ids.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

namespace semfoam {

// Gives the vertices and faces of meshes, and the points of clouds, that other programs have made
// of the same photos the labels of a foam.

struct LabelTransferOptions {
  // Distance up to which the matter of the foam counts, in units of the file; 0: by the scene
  // (MatterSearch).
  double tolerance = 0;
  // The smoothness of borders on meshes (CutFaceLabels), in units of the file; 0: none; negative:
  // twice the median radius of the foam's cells.
  double smoothness = -1;

  // Throws FieldError where a value is out of range.
  void RequireValid() const;
};

// What has got a label.
struct TransferredLabel {
  LabelId id = kNoObject;
  // DisplayName; empty for kNoObject.
  std::string name;
  int64_t vertices = 0;
  int64_t faces = 0;
  // Of the faces, in squared units of the file.
  double area = 0;
  // Mean over the vertices.
  double confidence = 0;
  // Of the vertices.
  Eigen::AlignedBox3d box;
};

struct TransferredLabels {
  int64_t vertices = 0;
  int64_t faces = 0;
  double area = 0;
  // Vertices farther than the tolerance from all matter, of those that were looked at.
  int64_t far = 0;
  int64_t looked_at = 0;
  // Of which the tolerance is in units of the file.
  double tolerance = 0;
  // Those that have vertices, by ascending id; kNoObject among them.
  std::vector<TransferredLabel> labels;
};

// Tells what is under way, from 0 to 1.
using TransferProgress = std::function<void(const std::string& what, double done)>;

// Copies the PLY `input`, a mesh or a point cloud in the frame of the scene's files, to `output`
// with a label and a confidence for each vertex, and for each face of a mesh (CopyPlyWithLabels).
//
// A place gets the label of the matter nearest to it (MatterSearch): along the normal of its point
// or face, where there is one. The faces of a mesh collect votes of places spread over them, and
// are labelled by a cut (CutFaceLabels); its vertices take the labels of their faces
// (VertexLabels). Clouds are read and written in blocks, meshes are held in memory but for what is
// only copied.
//
// Throws UserError, one sentence naming the file, where it cannot be read or written, or where most
// of its vertices are farther than the tolerance from all matter, as in another frame: then the
// sentence says how far. Writes nothing then.
TransferredLabels TransferLabels(const ExportableScene& scene,
                                 const std::filesystem::path& input,
                                 const std::filesystem::path& output,
                                 const LabelTransferOptions& options,
                                 const TransferProgress& progress);

// Writes the table of labels beside a labelled file: {"version": 1, "labels": {"7": "mug"},
// "source_model_xxh64": ..., "transfer": {"file": ..., "vertices": ..., ...}, "objects": [...]}.
// `file` is the name of the labelled file; `source_checksum` that of the foam, if not empty.
void WriteTransferSidecar(const std::filesystem::path& path,
                          const ExportableScene& scene,
                          const TransferredLabels& transferred,
                          const std::string& file,
                          const std::string& source_checksum);

}  // namespace semfoam
