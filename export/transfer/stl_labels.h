// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/transfer/polygon_mesh.h"
#include "foam/model/model.h"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace semfoam {

// A mesh from an STL, which is a list of triangles without any connection. Corners at the very same
// place are one vertex of the mesh; a place is told by all bits of its coordinates, but 0 is -0.
struct StlMesh {
  PolygonMesh mesh;
  // Whether the file is text.
  bool is_text = false;
  std::string bytes;
  // [faces] Where the facet begins and ends in `bytes`: in binary its 50 bytes, in text from
  // `facet` to the line break behind `endfacet`.
  std::vector<std::pair<size_t, size_t>> facets;

  std::string_view Facet(size_t f) const {
    return std::string_view(bytes).substr(facets[f].first, facets[f].second - facets[f].first);
  }
};

// Whether `head`, the first bytes of a file of `size` bytes, is that of an STL in binary (a count
// of triangles that take just the rest of the file) or in text (`solid`).
bool IsStl(std::string_view head, uint64_t size);

// Reads an STL, in text or binary. Takes memory in proportion to the file. Throws UserError, one
// sentence naming the file and the facet, where it cannot be read, its count of triangles is not
// that of its size, a facet has no three corners of three numbers, or there are no facets.
StlMesh ReadStl(const std::filesystem::path& path);

// Writes the mesh as a PLY, since an STL has no place for labels: its facets in their order, with
// their normals as in the file and, where one is not 0, the two bytes of each (`ushort attribute`);
// float coordinates of a binary STL, double ones of text. Vertices and faces carry label and
// confidence (CopyPlyWithLabels). `labels` is the table of names. Throws UserError where `output`
// cannot be written.
void WriteStlAsLabelledPly(const StlMesh& stl,
                           const std::filesystem::path& output,
                           const std::vector<Label>& labels,
                           std::span<const SurfaceLabel> vertex_labels,
                           std::span<const SurfaceLabel> face_labels);

// Writes each object as an STL of its own, objects/<id>_<name>.stl in `folder`, in the encoding of
// the input: its facets in their order and byte for byte; with `cap`, behind them, those that close
// it (FindBoundaryCaps). Returns the files, by ascending id. Throws UserError where one cannot be
// written.
std::vector<WrittenFile> SplitLabelledStl(const StlMesh& stl,
                                          const std::filesystem::path& folder,
                                          const std::vector<Label>& labels,
                                          const std::vector<SurfaceLabel>& face_labels,
                                          bool cap);

}  // namespace semfoam
