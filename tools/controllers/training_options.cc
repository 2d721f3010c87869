// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/training_options.h"

#include "tools/controllers/presets.h"

namespace semfoam {

void AddTrainingOptions(OptionManager* options, std::string* quality, TrainingOptions* training) {
  *training = OptionsForQuality(*quality);
  options->AddChoiceOption("quality",
                           quality,
                           Qualities(),
                           "presets num_rays, final_sites, sh_degree and the like",
                           [quality, training] { *training = OptionsForQuality(*quality); });
  const auto add = [options](const std::string& name, auto* value, const std::string& help) {
    options->AddDefaultOption("FoamTraining." + name, value, help);
  };
  add("num_rays", &training->num_rays, "rays over the whole run");
  add("late_rays", &training->late_rays, "rays after densify_until; 0 = their share of num_rays");
  add("rays_per_iteration", &training->rays_per_iteration, "batch size");
  add("initial_sites", &training->initial_sites, "SfM points beyond this are thinned");
  add("final_sites", &training->final_sites, "what densification grows to");
  add("sh_degree",
      &training->sh_degree,
      "of the view-dependent colour, 0 to 3, at most: raised only while it pays");
  add("transmittance_cutoff",
      &training->transmittance_cutoff,
      "rays stop where this share of the light is left");
  add("opacity_weight", &training->opacity_weight, "weight of the opacity loss");
  add("quantile_weight", &training->quantile_weight, "weight of the depth quantile loss");
  add("identity_weight", &training->identity_weight, "weight of the labels' cross-entropy");
  add("identity_to_density",
      &training->identity_to_density,
      "share of the gradient of the labels' cross-entropy that flows into density and positions, "
      "0 to 1; 0 = the paper's way");
  add("tv_weight", &training->tv_weight, "weight of the identities' total variation");
  add("position_rate",
      &training->position_rate,
      "learning rate of the sites, in radii of their cells");
  add("density_rate", &training->density_rate, "learning rate of the density");
  add("color_rate", &training->color_rate, "learning rate of the colour");
  add("sh_factor", &training->sh_factor, "higher SH degrees learn at this times color_rate");
  add("identity_rate", &training->identity_rate, "learning rate of the identity features");
  add("classifier_rate", &training->classifier_rate, "learning rate of the classifier, constant");
  add("final_rate", &training->final_rate, "what learning rates fall to, as a share");
  add("densify_from", &training->densify_from, "first densification, as a share of the run");
  add("densify_until", &training->densify_until, "last densification, as a share of the run");
  add("densify_events", &training->densify_events, "number of densifications");
  add("freeze_positions",
      &training->freeze_positions,
      "sites stay from here on, as a share of the run");
}

}  // namespace semfoam
