// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/transfer/label_source.h"
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
// of the same photos the labels of a foam, or of the photos' masks.

struct LabelTransferOptions {
  // Distance up to which the matter of a foam counts, in units of the file; 0: by the scene
  // (MatterSearch). For FoamLabels.
  double tolerance = 0;
  // The smoothness of borders on meshes (CutFaceLabels), in units of the file; 0: none; -1: twice
  // the resolution of the source.
  double smoothness = -1;
  // Whether to write each object as a file of its own, too, into objects/ beside the labelled file.
  bool split = false;
  // With `split`, of a mesh: whether the boundaries of each object are closed (FindBoundaryCaps).
  bool cap = false;

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
  // Vertices that the source does not know, of those that it was asked about: all of a cloud, a
  // sample of a mesh.
  int64_t unknown = 0;
  int64_t asked = 0;
  // Those that have vertices, by ascending id; kNoObject among them.
  std::vector<TransferredLabel> labels;
  // The files of objects; empty without LabelTransferOptions::split.
  std::vector<WrittenFile> parts;
};

// Tells what is under way, from 0 to 1.
using TransferProgress = std::function<void(const std::string& what, double done)>;

// Copies the PLY `input`, a mesh or a point cloud, to `output` with a label and a confidence for
// each vertex, and for each face of a mesh (CopyPlyWithLabels); an OBJ with a group for each label
// (CopyObjWithLabels), and its materials and textures into the folder of `output`; or an STL as a
// PLY (WriteStlAsLabelledPly). The name of `output` should be LabelledName.
//
// The faces of a mesh collect votes of places spread over them, and are labelled by a cut
// (CutFaceLabels); its vertices take the labels of their faces (VertexLabels). Clouds are read and
// written in blocks, unless the source needs the whole file; meshes are held in memory but for what
// is only copied.
//
// Throws UserError, one sentence naming the file, where it cannot be read or written, or where the
// source does not know most of its vertices, as in another frame: then the sentence says how far
// off they are. Writes nothing then.
TransferredLabels TransferLabels(LabelSource* source,
                                 const std::filesystem::path& input,
                                 const std::filesystem::path& output,
                                 const LabelTransferOptions& options,
                                 const TransferProgress& progress);

// Writes the table of labels beside a labelled file: {"version": 1, "labels": {"7": "mug"},
// "source_model_xxh64": ..., "transfer": {"file": ..., "vertices": ..., ...}, "objects": [...]}.
// `file` is the name of the labelled file; `source_checksum` that of the foam, if not empty.
void WriteTransferSidecar(const std::filesystem::path& path,
                          const LabelSource& source,
                          const TransferredLabels& transferred,
                          const std::string& file,
                          const std::string& source_checksum);

}  // namespace semfoam
