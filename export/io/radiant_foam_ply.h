// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/exportable_scene.h"
#include "foam/model/model.h"

#include <filesystem>

namespace semfoam {

// Writes and reads the PLY of Radiant Foam (its save_ply), binary little-endian:
//   element vertex N: float x y z; uchar red green blue, what the constant term of the colour
//     shows; float density, activated, per unit of x y z; uint adjacency_offset, where the site's
//     neighbours END; float color_sh_0.. the other 3 * ((degree + 1)^2 - 1) coefficients,
//     coefficient by coefficient, red green blue of each;
//   element adjacency 2E: uint adjacency, the neighbours of the first site, of the second, ...
// The format has no room for semantics, and keeps the constant colour with 8 bits.

// Writes the foam of `model` in the COLMAP frame, in floats, as the format requires. `scene` is
// made of `model`. Edges that exist only beyond the guard sites, far outside of the scene, are not
// listed. Throws UserError where floats would move the sites by more than a hundredth of a cell
// (coordinates far from the origin), and when the file cannot be written.
void WriteRadiantFoamPly(const std::filesystem::path& path,
                         const Model& model,
                         const ExportableScene& scene);

// Reads a foam. Ignores its adjacency, which the sites determine. The origin of the normalised
// frame is the sites' median, its unit their median distance from it, or more if far sites require
// it (kFarRadius). The model has no labels, photos and statistics. Sorts the sites in Hilbert
// order. Throws UserError, one sentence, for whatever PlyFile throws, a property that is missing, a
// position that is not finite, a density that is negative or not finite, a number of coefficients
// of no degree from 0 to 3, or offsets and neighbours that do not fit together.
Model ReadRadiantFoamPly(const std::filesystem::path& path);

}  // namespace semfoam
