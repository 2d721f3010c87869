// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/view/view_renderer.h"

#include <cstdint>
#include <string>

namespace semfoam {

// Options of a training. Lengths are of the normalised frame (the cameras' extent is about 1);
// times are fractions of the run. The papers' constants were tuned for 2e10 rays on a GPU; these
// are for 1e7 to 1e8 (foam/README.md).
struct TrainingOptions {
  // Number of rays over the whole run, > 0. The amount of work is fixed by numbers, so that the
  // result does not depend on the speed of the machine.
  int64_t num_rays = 30'000'000;
  // Of these, the rays after `densify_until`; 0 = their share of num_rays. Schedules of that part
  // are stretched or shortened with it.
  int64_t late_rays = 0;
  // Number of rays of an iteration, > 0.
  int rays_per_iteration = 4096;
  // Maximum number of sites at SfM points, >= 0; more points are thinned at random.
  int initial_sites = 20'000;
  // Number of sites after the last densification, >= 64.
  int final_sites = 100'000;
  // Maximum degree of the spherical harmonics, 0..3. The degree is raised as long as that lowers
  // the error on pixels that training has not seen.
  int sh_degree = 2;
  // Whether to raise the degree up to `sh_degree` without that test.
  bool fixed_sh_degree = false;
  // Time between two degrees, > 0: degree d is tried at d times that.
  double sh_degree_interval = 0.1;

  // Transmittance at which rays stop, > 0 and < 1.
  double transmittance_cutoff = kTransmittanceCutoff;

  // Weights of the loss terms (foam/render/ray_loss.h, foam/render/total_variation.h,
  // foam/render/color_variation.h), >= 0. The colour term has weight 1.
  double opacity_weight = 0.002;
  double quantile_weight = 1e-4;
  double distance_weight = 0.01;
  double identity_weight = 1;
  // Share of the identity loss's gradient that flows into densities and positions, 0..1.
  double identity_to_density = 0;
  double tv_weight = 2;
  double color_tv_weight = 0.05;

  // Learning rates at the start, each of which falls along a cosine to `final_rate` times that.
  //
  // Of positions, in units of the cell's radius.
  double position_rate = 0.04;
  double density_rate = 0.15;
  double color_rate = 2e-2;
  // Factor of `color_rate` for the SH coefficients of degree 1 and above.
  double sh_factor = 0.1;
  // Of the colour gradients: change of the display value over a cell's radius. 0: each cell is of
  // one colour.
  double color_gradient_rate = 5e-3;
  double identity_rate = 2e-2;
  // Of the classifier; constant over the run.
  double classifier_rate = 5e-3;
  double final_rate = 0.1;

  // Times of the first and the last densification, and their number.
  double densify_from = 0.05;
  double densify_until = 0.3;
  int densify_events = 10;
  // Time from which on positions stay and the topology is exact.
  double freeze_positions = 0.9;

  // Seed of all random numbers.
  uint64_t random_seed = 0;

  // If > 0, late_rays is chosen at the end of densification so that TrainFoam takes this number of
  // seconds. This is the only option that makes the result depend on the machine; the same options
  // with 0 here and TrainingSummary::late_rays give the same bytes.
  double seconds = 0;

  bool HasColorGradients() const { return color_gradient_rate > 0; }
  // Whether the topology needs the areas of the faces; `num_classes` 0: no semantics.
  bool NeedsAreas(int num_classes) const {
    return color_tv_weight > 0 || (num_classes > 0 && tv_weight > 0);
  }

  // Returns an empty string if all options are in range; else one sentence with the name of the
  // first that is not, at the beginning, and its range.
  std::string Check() const;

  // Describes every option by its name (checkpoint_state.h).
  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Number("num_rays", &num_rays);
    archive->Number("late_rays", &late_rays);
    archive->Number("rays_per_iteration", &rays_per_iteration);
    archive->Number("initial_sites", &initial_sites);
    archive->Number("final_sites", &final_sites);
    archive->Number("sh_degree", &sh_degree);
    archive->Number("fixed_sh_degree", &fixed_sh_degree);
    archive->Number("sh_degree_interval", &sh_degree_interval);
    archive->Number("transmittance_cutoff", &transmittance_cutoff);
    archive->Number("opacity_weight", &opacity_weight);
    archive->Number("quantile_weight", &quantile_weight);
    archive->Number("distance_weight", &distance_weight);
    archive->Number("identity_weight", &identity_weight);
    archive->Number("identity_to_density", &identity_to_density);
    archive->Number("tv_weight", &tv_weight);
    archive->Number("color_tv_weight", &color_tv_weight);
    archive->Number("position_rate", &position_rate);
    archive->Number("density_rate", &density_rate);
    archive->Number("color_rate", &color_rate);
    archive->Number("sh_factor", &sh_factor);
    archive->Number("color_gradient_rate", &color_gradient_rate);
    archive->Number("identity_rate", &identity_rate);
    archive->Number("classifier_rate", &classifier_rate);
    archive->Number("final_rate", &final_rate);
    archive->Number("densify_from", &densify_from);
    archive->Number("densify_until", &densify_until);
    archive->Number("densify_events", &densify_events);
    archive->Number("freeze_positions", &freeze_positions);
    archive->Number("random_seed", &random_seed);
    archive->Number("seconds", &seconds);
  }
};

// Returns the maximum number of sites at points at the start where there is a dense cloud: half of
// the final ones, so that densification still decides on the other half.
inline int PointSites(const TrainingOptions& options) { return options.final_sites / 2; }

// Return the numbers of sites besides the points at the start: those scattered in the space
// around the points, and those of the far background.
inline int ScatteredSites(const TrainingOptions& options) { return options.final_sites / 10; }
inline int FarSites(const TrainingOptions& options) { return options.final_sites / 40; }

}  // namespace semfoam
