// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/transfer/polygon_mesh.h"
#include "foam/model/model.h"

#include <filesystem>
#include <memory>
#include <vector>

namespace semfoam {

// The kinds of files that get labels.
enum class MeshFormat { kPly, kObj, kStl, kOm };

// Recognises a file by its first bytes, or where these tell nothing, by its name. Throws UserError
// where it cannot be read or is of no kind that is known.
MeshFormat RecognizeMeshFormat(const std::filesystem::path& path);

// Returns the name of the labelled file: that of the input, or where its format has no place for
// labels (STL), with the extension .ply instead of its own.
std::filesystem::path LabelledName(const std::filesystem::path& input, MeshFormat format);

// Throws UserError, before any work, where a file cannot be labelled as requested.
void RequireLabelledFormat(const std::filesystem::path& input,
                           const std::filesystem::path& output_path,
                           bool split);

// A mesh that gets labels, in its file.
class MeshFile {
 public:
  virtual ~MeshFile() = default;

  // The mesh of the file, as its reader returns it, with corners that are its vertices.
  virtual const PolygonMesh& mesh() const = 0;

  // Copies the file with the labels of its vertices and faces; all else stays as it is, as
  // CopyPlyWithLabels, CopyObjWithLabels, WriteStlAsLabelledPly and CopyOmWithLabels say.
  virtual void Write(const std::filesystem::path& output,
                     const std::vector<Label>& labels,
                     const std::vector<SurfaceLabel>& vertex_labels,
                     const std::vector<SurfaceLabel>& face_labels) const = 0;

  // Writes each object as a file of its own beside the labelled file, after Write
  // (SplitLabelledPly, SplitLabelledObj, SplitLabelledStl). RequireLabelledFormat says which
  // formats can.
  virtual std::vector<WrittenFile> Split(const std::filesystem::path& labelled,
                                         const std::vector<Label>& labels,
                                         const std::vector<SurfaceLabel>& face_labels,
                                         bool cap) const = 0;
};

// Reads a mesh whose labelled copy will be `output`, and will be `split` or not. Throws UserError
// as its reader does, and where there is something in the way of what belongs to it.
std::unique_ptr<MeshFile> ReadMeshFile(const std::filesystem::path& input,
                                       MeshFormat format,
                                       const std::filesystem::path& output,
                                       bool split);

}  // namespace semfoam
