// SPDX-License-Identifier: GPL-3.0-or-later
//
// make_street_blocks SITES COLUMNSxROWS WORKSPACE OUTPUT writes a street as OUTPUT/scene.foam and,
// in trained and polished blocks, as OUTPUT/blocks, whose project.ini names any COLMAP workspace:
// for measurements of exports and merges by hand.
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/export/blocks/street_foam.h"
#include "tests/tools/street_blocks.h"

int main(int argc, char** argv) {
  int columns = 0, rows = 0;
  const int num_sites = argc == 5 ? std::atoi(argv[1]) : 0;
  if (num_sites < 1000 || std::sscanf(argv[2], "%dx%d", &columns, &rows) != 2 || columns < 1 ||
      rows < 1) {
    std::fprintf(stderr, "Usage: make_street_blocks SITES COLUMNSxROWS WORKSPACE OUTPUT\n");
    return 1;
  }
  const std::filesystem::path output = argv[4];
  const semfoam::Model model = semfoam::StreetFoam(num_sites, /*seed=*/1);
  std::filesystem::create_directories(output / "blocks");
  semfoam::WriteModel(output / "scene.foam", model);
  semfoam::WriteTrainedBlocks(
      output / "blocks", model, columns, rows, /*halo=*/0.05f, /*are_polished=*/true);
  std::ofstream(output / "blocks/project.ini")
      << "workspace_path=" << argv[3] << "\nblocks=" << argv[2] << "\n";
  return 0;
}
