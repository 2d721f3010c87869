// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/view/view_renderer.h"

#include <cstdint>
#include <string>

namespace semfoam {

// How a foam is trained. Lengths are of the normalised frame (the cameras' extent is about 1);
// times are fractions of the run. The papers' constants were tuned for 2e10 rays on a GPU; these
// are for 1e7 to 1e8 (foam/README.md).
struct TrainingOptions {
  // The work: fixed numbers, so that the speed of the machine changes no byte.
  int64_t num_rays = 30'000'000;  // over the whole run, > 0
  // Of these, the rays after `densify_until`; 0 = their share of num_rays. Schedules of that part
  // are stretched or shortened with it.
  int64_t late_rays = 0;
  int rays_per_iteration = 4096;  // batch size, > 0
  int initial_sites = 20'000;     // SfM points beyond this are thinned, >= 0
  int final_sites = 100'000;      // what densification grows to, >= 64
  int sh_degree = 2;              // 0..3, at most: raised while it pays on photos not seen
  bool fixed_sh_degree = false;   // raised to sh_degree whether it pays or not

  // Rays stop where this share of the light is left, > 0 and < 1.
  double transmittance_cutoff = kTransmittanceCutoff;

  // Weights of the loss terms (foam/render/ray_loss.h, foam/render/total_variation.h), >= 0. The
  // colour term has weight 1.
  double opacity_weight = 0.002;
  double quantile_weight = 1e-4;
  double identity_weight = 1;
  // The share of the identity loss's gradient that shapes densities and positions as well; 0..1.
  double identity_to_density = 0;
  double tv_weight = 2;

  // Learning rates at the start; each falls on a cosine to `final_rate` times that.
  double position_rate = 0.04;  // of a cell's radius
  double density_rate = 0.1;
  double color_rate = 2e-2;
  double sh_factor = 0.1;  // higher SH degrees learn at this times the colour rate
  double identity_rate = 2e-2;
  double classifier_rate = 5e-3;  // constant
  double final_rate = 0.1;

  double densify_from = 0.05;
  double densify_until = 0.6;
  int densify_events = 10;
  double freeze_positions = 0.9;  // from here on positions stay, and the topology is exact

  uint64_t random_seed = 0;

  // > 0: late_rays is chosen where densification ends, so that TrainFoam takes so many seconds.
  // Alone of all options it makes a run depend on the machine; the same options with 0 here and
  // TrainingSummary::late_rays give the same bytes.
  double seconds = 0;

  // An empty string, or one sentence that begins with the name of the option out of range and tells
  // its range.
  std::string Check() const;

  // Every option by its name (checkpoint_state.h).
  template <typename Archive>
  void Serialize(Archive* archive) {
    archive->Number("num_rays", &num_rays);
    archive->Number("late_rays", &late_rays);
    archive->Number("rays_per_iteration", &rays_per_iteration);
    archive->Number("initial_sites", &initial_sites);
    archive->Number("final_sites", &final_sites);
    archive->Number("sh_degree", &sh_degree);
    archive->Number("fixed_sh_degree", &fixed_sh_degree);
    archive->Number("transmittance_cutoff", &transmittance_cutoff);
    archive->Number("opacity_weight", &opacity_weight);
    archive->Number("quantile_weight", &quantile_weight);
    archive->Number("identity_weight", &identity_weight);
    archive->Number("identity_to_density", &identity_to_density);
    archive->Number("tv_weight", &tv_weight);
    archive->Number("position_rate", &position_rate);
    archive->Number("density_rate", &density_rate);
    archive->Number("color_rate", &color_rate);
    archive->Number("sh_factor", &sh_factor);
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

// Sites that training begins with besides the SfM points: those that fill the space around, and
// those of the far background.
inline int ScatteredSites(const TrainingOptions& options) { return options.final_sites / 10; }
inline int FarSites(const TrainingOptions& options) { return options.final_sites / 40; }

}  // namespace semfoam
