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

// Cells as points, for programs that know points but no cells. All in the COLMAP frame.

// Which cells stand for what one sees: the solid, photographed ones that `filter` has (HasCell);
// all of them for an empty one. Ascending. So the cells of one object are exactly those of all
// cells whose `object` is its id.
std::vector<uint32_t> VisibleCells(const ExportableScene& scene, const LabelFilter& filter);

// PLY, binary little-endian, one vertex per cell, at its site: double x y z, uchar red green blue
// (display values, what photos show), int label (of the cell's own class), int object (id of the
// object that the exports count it to, 0 = none), float confidence, float density (per COLMAP
// unit), float radius. The label table stands in a comment. Throws UserError when the file cannot
// be written.
void WriteCellPoints(const std::filesystem::path& path,
                     const ExportableScene& scene,
                     const std::vector<uint32_t>& cells);

// PLY as Gaussian splatting writes it, for its viewers: float x y z nx ny nz f_dc_0..2 f_rest_0..44
// (degree 3, higher ones 0; channel by channel) opacity (logit) scale_0..2 (log) rot_0..3 (w x y
// z); and int label, int object (as of WriteCellPoints), float confidence at the end, which viewers
// pass over.
//
// A splat is a Gaussian in place of a cell: the mean and the covariance of a solid body of the
// cell's shape, its extent by `splat_scale`; as opaque in its middle as the cell is along its
// mean diameter. Corners farther from the site than three times the cell's radius count as that
// far: cells on wide empty space would be needles.
//
// Positions are floats, as the format has them: a model far from its origin loses digits. Throws
// UserError when the file cannot be written.
void WriteSplats(const std::filesystem::path& path,
                 const Model& model,
                 const ExportableScene& scene,
                 const std::vector<uint32_t>& cells,
                 double splat_scale);

// The whole foam as text, for eyes and scripts: the frame, the labels, and one line per site:
//   SITE X Y Z DENSITY RADIUS VOLUME LABEL CONFIDENCE R G B OBJECT SH[] NEIGHBORS[]
// in COLMAP units (guards are no neighbours here); numbers are the shortest that read back the
// same. The header in the file explains the columns. Throws UserError when the file cannot be
// written.
void WriteFoamText(const std::filesystem::path& path,
                   const Model& model,
                   const ExportableScene& scene);

}  // namespace semfoam
