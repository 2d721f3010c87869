// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "export/scene/label_choice.h"
#include "foam/model/model.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace semfoam {

// Writes cells as points, for programs without a cell format. All positions are in the COLMAP
// frame.

// Returns the visible cells, ascending: the solid, photographed ones that `filter` selects
// (HasCell), or all of these for an empty filter. So the cells of one object are exactly those of
// all cells whose `object` is its id.
std::vector<uint32_t> VisibleCells(const ExportableScene& scene, const LabelFilter& filter);

// Writes a PLY, binary little-endian, with one vertex per cell, at its site: double x y z, uchar
// red green blue (display values as in the photos), int label (of the cell's own class), int object
// (id of the object that the cell belongs to in the exports, 0 = none), float confidence, float
// density (per COLMAP unit), float radius. The label table is in a comment. Throws UserError when
// the file cannot be written.
void WriteCellPoints(const std::filesystem::path& path,
                     const ExportableScene& scene,
                     const std::vector<uint32_t>& cells);

// Writes a PLY in the format of Gaussian splatting, for its viewers: float x y z nx ny nz f_dc_0..2
// f_rest_0..44 (degree 3, higher ones 0; channel by channel) opacity (logit) scale_0..2 (log)
// rot_0..3 (w x y z); and int label, int object (as of WriteCellPoints), float confidence at the
// end, which viewers ignore.
//
// A splat is a Gaussian with the mean and the covariance of a solid body of the cell's shape,
// scaled by `splat_scale`; its opacity in the middle is that of the cell along its mean diameter.
// Corners farther from the site than three times the cell's radius are moved to that distance,
// because cells next to wide empty space would be needles.
//
// Positions are floats, as the format requires: a model far from its origin loses digits. Throws
// UserError when the file cannot be written.
void WriteSplats(const std::filesystem::path& path,
                 const Model& model,
                 const ExportableScene& scene,
                 const std::vector<uint32_t>& cells,
                 double splat_scale);

// Writes the whole foam as text, for people and scripts: the frame, the labels, and one line per
// site:
//   SITE X Y Z DENSITY RADIUS VOLUME LABEL CONFIDENCE R G B OBJECT SH[] NEIGHBORS[]
// in COLMAP units (guards are no neighbours here); numbers are the shortest that read back the
// same. The header in the file explains the columns. Throws UserError when the file cannot be
// written.
void WriteFoamText(const std::filesystem::path& path,
                   const Model& model,
                   const ExportableScene& scene);

}  // namespace semfoam
