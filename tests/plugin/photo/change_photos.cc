// SPDX-License-Identifier: GPL-3.0-or-later
//
// Makes test data with changing exposure: a copy of a COLMAP workspace whose photos were taken, as
// it were, by a camera on automatic with a poor lens.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "tests/plugin/photo/changed_photos.h"

int main(int argc, char** argv) {
  if (argc != 7) {
    std::fprintf(stderr,
                 "Usage: change_photos SOURCE TARGET EXPOSURE WHITE_BALANCE FALLOFF SEED\n"
                 "EXPOSURE and WHITE_BALANCE are standard deviations of log gains, FALLOFF is the "
                 "share of light lost in the corners.\n");
    return EXIT_FAILURE;
  }
  try {
    semfoam::CameraHabits habits;
    habits.exposure = std::stod(argv[3]);
    habits.white_balance = std::stod(argv[4]);
    habits.falloff = std::stod(argv[5]);
    habits.seed = std::stoull(argv[6]);
    semfoam::WriteChangedWorkspace(argv[1], argv[2], habits);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "ERROR: %s\n", error.what());
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
