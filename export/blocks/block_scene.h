// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/blocks/foam_blocks.h"
#include "export/scene/exportable_scene.h"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

namespace semfoam {

// The cells of one block, and of the sites of other blocks around it. The cells of the block are
// those of the whole foam: neighbours, corners, faces, volumes and radii. Those of the sites around
// it are not.
struct BlockScene {
  // Cells [0, num_own) are the block's, in its order; then those around it; then the guards.
  // Without objects.
  ExportableScene scene;
  uint32_t num_own = 0;
  // [scene.delaunay.num_cells] Number of each cell in the whole foam, ascending from num_own on.
  // The sites of all blocks are numbered through, block after block; the guards come behind them.
  std::vector<uint32_t> ids;
  // [num_own] Whether the cell holds the centre of a camera.
  std::vector<uint8_t> has_camera;
};

// Makes the scenes of the blocks of a foam.
class BlockScenes {
 public:
  // Reads all positions once, block after block. Keeps a reference to `blocks`. Throws what reading
  // does. CHECKs that there are less than 2^32 cells.
  BlockScenes(const FoamBlocks& blocks, const ExportableSceneOptions& options);

  size_t NumBlocks() const { return outlines_.size(); }
  // Returns the number of sites of all blocks.
  uint32_t NumSites() const { return num_sites_; }
  // Returns the number in the whole foam of the first site of a block.
  uint32_t FirstId(size_t block) const { return outlines_[block].first_id; }

  const FoamBlocks& blocks() const { return blocks_; }
  const ExportableSceneOptions& options() const { return options_; }

  // Makes the scene of a block, with as many sites around it as determine its cells. Throws what
  // reading does.
  BlockScene Make(size_t block);

 private:
  struct Outline {
    uint32_t first_id = 0;
    uint32_t num_sites = 0;
    Eigen::AlignedBox3d box;  // of its sites
    // Numbers of the sites around it, ascending; known after the first Make.
    std::vector<uint32_t> around;
    bool is_known = false;
  };

  // Finds the sites of other blocks that determine the cells of this one.
  void FindSitesAround(size_t block);
  // Returns the sites of a block whose numbers are among `ids`, ascending, by their places in it.
  std::vector<uint32_t> PlacesIn(size_t block, const std::vector<uint32_t>& ids) const;

  const FoamBlocks& blocks_;
  const ExportableSceneOptions options_;
  uint32_t num_sites_ = 0;
  std::vector<Outline> outlines_;
};

}  // namespace semfoam
