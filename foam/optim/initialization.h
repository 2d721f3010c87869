// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/data/training_views.h"
#include "foam/model/foam.h"

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

// The foam that training starts from.

namespace semfoam {

struct InitializationOptions {
  // Maximum number of sites at SfM points; more points are thinned at random.
  size_t max_seed_sites = 40'000;
  // Maximum number of sites at points of a dense cloud and SfM points together; the points of the
  // cloud are thinned by voxels (point_thinning.h), and none is used where the SfM points are as
  // many.
  size_t max_point_sites = 50'000;
  // Number of sites scattered in the space around cameras and points.
  size_t num_scattered = 4'000;
  // Number of sites in the shell beyond, of log-uniform radius up to kFarRadius, or half of it
  // where there are seeds of sky (IsSkySite): the far background.
  size_t num_far = 2'000;
  // Degree of the spherical harmonics, 0..3.
  int sh_degree = 2;
  // Number of classes; 0: no semantics.
  int num_classes = 0;
  // Seed of all random numbers.
  uint64_t seed = 0;
};

// Returns the seeds with those of a dense cloud (SeedPoint::is_dense) thinned to
// `options.max_point_sites`. All SfM points stay, in their order, before them. Does nothing the
// second time.
std::vector<SeedPoint> ThinDenseSeeds(std::vector<SeedPoint> seeds,
                                      const InitializationOptions& options);

// The raw density with which a site at a point begins, and the SH coefficient of degree 0 of a
// display value.
float RawDensityOfSeed();
float ShOfSeedColor(float value);

// Returns a foam with a site at every seed, in its colour, and empty sites around these, in Hilbert
// order. `camera_centers` as `seeds` in the normalised frame. Works without points too. Points and
// random places beyond kFarRadius are left out, but for sky (IsSkySite). Points of a dense
// cloud must have been thinned by ThinDenseSeeds.
Foam InitialFoam(const std::vector<SeedPoint>& seeds,
                 const std::vector<Eigen::Vector3d>& camera_centers,
                 const InitializationOptions& options);

}  // namespace semfoam
