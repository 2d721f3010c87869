// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/model.h"

#include <cstddef>
#include <functional>
#include <vector>

#include <Eigen/Core>

// Exports of a foam that is stored in blocks of space, each of which is read when it is needed, so
// that no more than one block and its surroundings is in memory:
//
//   BlockScenes        the cells of one block, exact up to its seams        block_scene.h
//   FindBlockObjects   the objects of all blocks                            block_objects.h
//   BlockPieces        their faces and voxels, block by block, on disk      block_pieces.h
//   JoinSurface        the faces of one object, joined across the seams     block_surfaces.h

namespace semfoam {

// A foam without CellStatistics in blocks. Every site is in one of them; those at the same place
// are all in the same one.
struct FoamBlocks {
  // Labels, photos, frame, and the classifier of `foam`, without cells.
  Model run;
  size_t num_blocks = 0;
  // Width of the space around a block, normalised frame, whose sites are looked at first. It
  // changes the time that an export takes, not what is written.
  float halo = 0;
  // Read the sites of a block, in the same order at every call: their positions; and all of them as
  // a foam of SH degree 0, without the classifier's weights. May throw UserError.
  std::function<std::vector<Eigen::Vector3f>(size_t block)> read_positions;
  std::function<Foam(size_t block)> read_foam;
};

}  // namespace semfoam
