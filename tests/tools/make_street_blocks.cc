// SPDX-License-Identifier: GPL-3.0-or-later
//
// make_street_blocks SITES COLUMNSxROWS OUTPUT writes a street as OUTPUT/scene.foam and, in trained
// blocks, as OUTPUT/blocks: for measurements of exports by hand.
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "tests/export/blocks/street_foam.h"
#include "tests/tools/street_blocks.h"

int main(int argc, char** argv) {
  int columns = 0, rows = 0;
  const int num_sites = argc == 4 ? std::atoi(argv[1]) : 0;
  if (num_sites < 1000 || std::sscanf(argv[2], "%dx%d", &columns, &rows) != 2 || columns < 1 ||
      rows < 1) {
    std::fprintf(stderr, "Usage: make_street_blocks SITES COLUMNSxROWS OUTPUT\n");
    return 1;
  }
  const std::filesystem::path output = argv[3];
  const semfoam::Model model = semfoam::StreetFoam(num_sites, /*seed=*/1);
  std::filesystem::create_directories(output / "blocks");
  semfoam::WriteModel(output / "scene.foam", model);
  semfoam::WriteTrainedBlocks(output / "blocks", model, columns, rows, /*halo=*/0.05f);
  return 0;
}
