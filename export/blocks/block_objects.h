// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/blocks/block_scene.h"
#include "export/scene/exportable_scene.h"

namespace semfoam {

// Finds the objects of a foam in blocks by the rules of MakeExportableScene, which has the same for
// the whole foam, but for sites at the same distances and the last bits of sums.
//
// Makes the scene of one block after the other. Keeps of it a number a cell, and of each connected
// component within a block (of the matter of a class, or of air) its measures; components of
// different blocks are joined where cells on both sides of a seam are neighbours.
//
// The result has frames, labels and objects of an ExportableScene, with the cells by their numbers
// in the whole foam (BlockScene::ids), and object_of_cell [scenes->NumSites()], but no other data
// of cells. Of the objects, area, centroid, cavities and genus are not known yet
// (DescribeBySurface). Throws what reading the blocks does.
ExportableScene FindBlockObjects(BlockScenes* scenes);

}  // namespace semfoam
