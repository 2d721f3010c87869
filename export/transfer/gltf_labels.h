// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/transfer/companion_files.h"
#include "export/transfer/polygon_mesh.h"
#include "foam/model/model.h"

#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

namespace semfoam {

// Whether `head`, the first bytes of a file, is that of a binary glTF (.glb).
bool IsGlb(std::string_view head);

// The triangles of a glTF 2.0 file, .glb or .gltf with its buffers beside it or in it.
class GltfMesh {
 public:
  // Reads all triangles, strips and fans of all nodes, in the order of the nodes; a mesh of two
  // nodes is there twice. Places are in the frame of the root nodes' parents, in double; but of a
  // file of GlbFile, whose root node cancels what importers do, in the frame that its "extras" name
  // ("frame"). Points and lines are not read. Takes memory in proportion to the file.
  //
  // Throws UserError, one sentence naming the file and the element, where it cannot be read, is no
  // glTF 2.0, is compressed (Draco, meshopt), moves its vertices (skins, morph targets, instances),
  // has sparse accessors, refers to what it does not have, or has no triangles.
  explicit GltfMesh(const std::filesystem::path& path);
  ~GltfMesh();

  const PolygonMesh& mesh() const;

  // The buffers and images that a .gltf names, as far as they are there (AddCompanionFile).
  CompanionFiles Companions(const std::filesystem::path& folder) const;

  // Writes the file with the faces of each node in a mesh for each label, on a node below it; both
  // have the name of the label ("unlabelled" for kNoObject), and the node the "extras" "label" (its
  // id), "name" and "confidence", the mean of its faces. Their primitives have the accessors, the
  // material and all else of the one they come from, and indices of their own behind everything
  // that was in the buffer (in a .gltf: in a buffer of their own, within the file). Buffers and
  // images stay byte for byte; the JSON keeps its values and their order. `labels` is the table of
  // names. Throws UserError where `output` cannot be written or would not fit into 4 GiB.
  void Write(const std::filesystem::path& output,
             const std::vector<Label>& labels,
             const std::vector<SurfaceLabel>& face_labels) const;

 private:
  struct Content;
  std::unique_ptr<Content> content_;
};

}  // namespace semfoam
