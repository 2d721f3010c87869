// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/model/foam.h"

#include <vector>

namespace semfoam {

struct InitializationOptions {
  size_t max_seed_sites = 40'000;  // SfM points beyond this are thinned, at random
  size_t num_scattered = 4'000;    // sites that fill the space around cameras and points
  size_t num_far =
      2'000;  // sites in the shell beyond, log-uniform radius up to kFarRadius: the far background
  int sh_degree = 2;
  int num_classes = 0;
  uint64_t seed = 0;
};

// The foam that training starts from: a site at every SfM point, in its colour; empty sites around;
// in Hilbert order. Works without points too. `camera_centers` in the normalised frame.
Foam InitialFoam(const std::vector<SeedPoint>& seeds,
                 const std::vector<Eigen::Vector3d>& camera_centers,
                 const InitializationOptions& options);

}  // namespace semfoam
