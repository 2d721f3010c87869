// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/transfer/ply_labels.h"
#include "export/transfer/polygon_mesh.h"
#include "foam/model/model.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string_view>
#include <vector>

namespace semfoam {

// Point clouds of laser scanners and drones: LAS 1.0 to 1.4, point formats 0 to 10 (ASPRS, LAS 1.4
// R15). LAZ is refused.

// Whether `head`, the first bytes of a file, is that of a LAS or LAZ.
bool IsLas(std::string_view head);

// The class of a point for each label, and 0 for what has none.
using LasClasses = std::map<LabelId, uint8_t>;

// What the header of a LAS says.
struct LasHeader {
  uint64_t num_points = 0;
  uint64_t first_byte = 0;  // of the points
  int format = 0;
  size_t record_bytes = 0;
  // x = scale * stored + offset.
  Eigen::Vector3d scale;
  Eigen::Vector3d offset;

  // The largest class that a point can have: 31 of formats 0 to 5, else 255.
  int MaxClass() const { return format < 6 ? 31 : 255; }
};

// Reads the header. Throws UserError, one sentence naming the file, where it cannot be read, is no
// LAS, is compressed (LAZ), or is shorter than its points.
LasHeader ReadLasHeader(const std::filesystem::path& path);

// Reads the places of all points, in the frame of the file. Throws UserError as ReadLasHeader does.
PolygonMesh ReadLasPoints(const std::filesystem::path& path);

// Returns the ids as classes where all are at most MaxClass, else 1, 2 ... by ascending id. Throws
// UserError where there are more labels than classes.
LasClasses ClassesOf(const std::filesystem::path& path,
                     const LasHeader& header,
                     const std::vector<Label>& labels);

// Copies the LAS `input` to `output` and sets the class of each point to that of its label; of
// formats 0 to 5 the three flags in the same byte stay. Everything else stays as it is, byte for
// byte: header, variable length records, all else of the points, what follows them. Holds blocks of
// 65536 points, whatever the size of the file. `check` as for CopyPlyWithLabels. Throws UserError
// as ReadLasHeader does, or where `output` cannot be written, which is then not there.
void CopyLasWithLabels(
    const std::filesystem::path& input,
    const std::filesystem::path& output,
    const LasClasses& classes,
    const LabelPlyBlock& label_points,
    const std::function<void()>& check = [] {});

}  // namespace semfoam
