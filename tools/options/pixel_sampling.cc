// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/options/pixel_sampling.h"

#include "foam/util/error.h"

namespace semfoam {
namespace {

constexpr int kMostRays = 8;

}  // namespace

void AddSupersampleOption(OptionManager* options, int* supersample) {
  options->AddDefaultOption("supersample",
                            supersample,
                            "N x N rays a pixel, averaged, 1 to 8: a photo's pixel is the mean of "
                            "its area; time grows with N x N");
}

void CheckSupersample(int supersample) {
  if (supersample >= 1 && supersample <= kMostRays) return;
  throw FieldError("supersample", " is ", supersample, "; it must be from 1 to ", kMostRays, ".");
}

}  // namespace semfoam
