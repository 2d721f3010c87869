// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/training_options.h"

#include <cmath>
#include <sstream>

namespace semfoam {

std::string TrainingOptions::Check() const {
  std::ostringstream reason;
  const auto require = [&](bool ok, const char* name, const char* range, auto value) {
    if (!ok && reason.str().empty()) {
      reason << name << " is " << value << "; it must be " << range << ".";
    }
  };
  const auto positive = [&](const char* name, double value) {
    require(value > 0 && std::isfinite(value), name, "greater than 0", value);
  };
  const auto not_negative = [&](const char* name, double value) {
    require(value >= 0 && std::isfinite(value), name, "0 or more", value);
  };
  // Beyond this, products of parameters leave the range of floats.
  const auto bounded = [&](const char* name, double value) {
    require(value >= 0 && value <= 1e6, name, "from 0 to 1000000", value);
  };
  const auto fraction = [&](const char* name, double value) {
    require(value >= 0 && value <= 1, name, "from 0 to 1", value);
  };
  positive("num_rays", num_rays);
  not_negative("late_rays", late_rays);
  require(rays_per_iteration >= 1 && rays_per_iteration <= 1 << 24,
          "rays_per_iteration",
          "from 1 to 16777216",
          rays_per_iteration);
  not_negative("initial_sites", initial_sites);
  require(final_sites >= 64 && final_sites <= 1 << 28,
          "final_sites",
          "from 64 to 268435456",
          final_sites);
  require(sh_degree >= 0 && sh_degree <= 3, "sh_degree", "from 0 to 3", sh_degree);
  require(transmittance_cutoff > 0 && transmittance_cutoff < 1,
          "transmittance_cutoff",
          "greater than 0 and less than 1",
          transmittance_cutoff);
  bounded("opacity_weight", opacity_weight);
  bounded("quantile_weight", quantile_weight);
  bounded("distance_weight", distance_weight);
  bounded("identity_weight", identity_weight);
  fraction("identity_to_density", identity_to_density);
  bounded("tv_weight", tv_weight);
  bounded("color_tv_weight", color_tv_weight);
  bounded("position_rate", position_rate);
  bounded("density_rate", density_rate);
  bounded("color_rate", color_rate);
  bounded("sh_factor", sh_factor);
  bounded("color_gradient_rate", color_gradient_rate);
  bounded("identity_rate", identity_rate);
  bounded("classifier_rate", classifier_rate);
  fraction("final_rate", final_rate);
  fraction("densify_from", densify_from);
  fraction("densify_until", densify_until);
  not_negative("densify_events", densify_events);
  fraction("freeze_positions", freeze_positions);
  return reason.str();
}

}  // namespace semfoam
