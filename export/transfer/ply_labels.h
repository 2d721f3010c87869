// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/transfer/polygon_mesh.h"
#include "foam/model/model.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The records of an element, a block of consecutive ones at a time, in the order of the file.
struct PlyBlock {
  // Index of the first.
  uint64_t first = 0;
  // [records] Of vertices; empty of faces.
  std::span<const Eigen::Vector3d> positions;
  // [records] Of vertices that have normals, as in the file; else empty.
  std::span<const Eigen::Vector3f> normals;
};
// Sets the labels [records] of a block.
using LabelPlyBlock = std::function<void(const PlyBlock& block, std::span<SurfaceLabel> labels)>;

// Returns the lines of a PLY's header that name labels, `comment label ID NAME`, but for that of id
// 0.
std::string PlyLabelComments(const std::vector<Label>& labels, const std::string& line_end = "\n");

// Copies the PLY `input` to `output` and gives each vertex, and each face if there are any, two
// properties more, `int label` and `float confidence`, behind all others. Everything else stays as
// it is, byte for byte and in order, in text or binary of either byte order: other properties and
// elements, polygons, comments, and what follows the last record. Replaces properties of these two
// names, and the comments of an earlier copy. A comment `label ID NAME` names each of `labels` but
// that of id 0.
//
// Holds blocks of 65536 records, whatever the size of the file. Calls `check` when all records are
// labelled and before `output` is put into place, which an exception of it prevents. Throws
// UserError, one sentence naming the file, where `input` cannot be read or `output` cannot be
// written, which is then not there.
void CopyPlyWithLabels(
    const std::filesystem::path& input,
    const std::filesystem::path& output,
    const std::vector<Label>& labels,
    const LabelPlyBlock& label_vertices,
    const LabelPlyBlock& label_faces,
    const std::function<void()>& check = [] {});

}  // namespace semfoam
