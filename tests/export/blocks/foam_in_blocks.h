// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/blocks/foam_blocks.h"
#include "foam/model/model.h"
#include "foam/train/space_blocks.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace semfoam {

// A model cut into blocks of space, as scene_splitter cuts it.
struct FoamInBlocks {
  FoamBlocks blocks;
  // The model's site of each number in the blocks.
  std::vector<uint32_t> site_of_id;
};

// Cuts a model without statistics, of SH degree 0, into columns x rows blocks of the same number of
// sites.
inline FoamInBlocks CutIntoBlocks(const Model& model, int columns, int rows, float halo) {
  const Foam& foam = model.foam;
  const std::vector<BlockBox> boxes =
      SplitSpace(foam.positions, std::vector<double>(foam.NumSites(), 1.0), columns, rows);
  FoamInBlocks cut;
  const auto foams = std::make_shared<std::vector<Foam>>();
  for (const BlockBox& box : boxes) {
    Foam& block = foams->emplace_back();
    block.num_classes = foam.num_classes;
    for (uint32_t i = 0; i < foam.NumSites(); ++i) {
      if (!box.Contains(foam.positions[i])) continue;
      cut.site_of_id.push_back(i);
      block.positions.push_back(foam.positions[i]);
      block.raw_density.push_back(foam.raw_density[i]);
      for (int c = 0; c < 3; ++c) block.sh.push_back(foam.sh[3 * i + c]);
      if (!foam.HasSemantics()) continue;
      block.identity.insert(block.identity.end(),
                            foam.identity.begin() + i * kIdentityDim,
                            foam.identity.begin() + (i + 1) * kIdentityDim);
    }
  }
  cut.blocks.run = model;
  cut.blocks.run.foam = {};
  cut.blocks.run.foam.num_classes = foam.num_classes;
  cut.blocks.run.foam.classifier_weight = foam.classifier_weight;
  cut.blocks.run.foam.classifier_bias = foam.classifier_bias;
  cut.blocks.num_blocks = foams->size();
  cut.blocks.halo = halo;
  cut.blocks.read_positions = [foams](size_t block) { return (*foams)[block].positions; };
  cut.blocks.read_foam = [foams](size_t block) { return (*foams)[block]; };
  return cut;
}

}  // namespace semfoam
