// SPDX-License-Identifier: GPL-3.0-or-later
//
// make_street_photos PHOTOS WIDTHxHEIGHT OUTPUT writes a COLMAP workspace of a drive along a
// street, 20 photos a unit: for measurements of large inputs by hand.
#include <cstdio>
#include <cstdlib>

#include "tests/tools/street_capture.h"

int main(int argc, char** argv) {
  int width = 0, height = 0;
  const int num_photos = argc == 4 ? std::atoi(argv[1]) : 0;
  if (num_photos < 1 || std::sscanf(argv[2], "%dx%d", &width, &height) != 2 || width < 8 ||
      height < 8) {
    std::fprintf(stderr, "Usage: make_street_photos PHOTOS WIDTHxHEIGHT OUTPUT\n");
    return 1;
  }
  semfoam::StreetCapture(num_photos, width, height, /*photos_per_length=*/20, /*seed=*/1)
      .Write(argv[3]);
  return 0;
}
