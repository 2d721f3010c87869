// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/exportable_scene.h"

#include <cstdint>
#include <vector>

namespace semfoam {

// Adds a piece, a list of cells, to what is left out of an object. Reads the scene's geometry
// alone.
void LeaveOut(const ExportableScene& scene,
              const std::vector<uint32_t>& piece,
              LeftOutPieces* left_out);

// Counts the connected pieces of every object, and takes out those that `options` do not want:
// first the ones with too few cells, then all but the largest. The cells of these belong to no
// object any more; an object that loses all of its pieces goes from `objects` to
// `labels_left_out`. Largest: by volume; of equals, the one with the lowest cell.
void KeepPieces(const PieceOptions& options, ExportableScene* scene);

}  // namespace semfoam
