// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/options/effects_options.h"

#include "foam/util/error.h"

namespace semfoam {
namespace {

EffectSwitch ToSwitch(const std::string& text) {
  return text == "on"    ? EffectSwitch::kOn
         : text == "off" ? EffectSwitch::kOff
                         : EffectSwitch::kAuto;
}

}  // namespace

void AddEffectsOptions(OptionManager* options, EffectsChoices* choices) {
  const auto add = [options](const std::string& name, std::string* value, const std::string& help) {
    options->AddChoiceOption("Effects." + name, value, {"auto", "on", "off"}, help);
  };
  add("exposure", &choices->exposure, "a gain for each photo; auto = what the tracks show");
  add("white_balance", &choices->white_balance, "three gains for each photo; likewise");
  add("vignetting", &choices->vignetting, "a falloff towards the corners; likewise");
  add("shading",
      &choices->shading,
      "a smooth field of gains for each photo; auto = what the foam explains of held-back pixels");
  options->AddChoiceOption(
      "Effects.transients",
      &choices->transients,
      {"auto", "off"},
      "things that pass by are left out; auto = where a photo shows what no other does");
  options->AddChoiceOption(
      "Effects.sky",
      &choices->sky,
      {"auto", "off"},
      "what is infinitely far lies on a sphere around everything; auto = where "
      "photos agree on it at no nearer distance");
  options->AddChoiceOption("Effects.blur",
                           &choices->blur,
                           {"auto", "off"},
                           "blurred photos count less; auto = where others show more contrast");
  add("poses",
      &choices->poses,
      "camera poses are refined; auto = where held-back tracks and pixels gain by it");
  add("distortion", &choices->distortion, "auto = on where it moves corners by 0.1 pixels or more");
  options->AddChoiceOption("Effects.semantics",
                           &choices->semantics,
                           {"auto", "off"},
                           "identities and labels; auto = on where there are masks");
  options->AddChoiceOption(
      "Effects.sh_degree",
      &choices->sh_degree,
      {"auto", "on"},
      "on = FoamTraining.sh_degree as it is; auto = up to that, while it pays");
}

EffectsOptions MakeEffectsOptions(const EffectsChoices& choices) {
  if (choices.exposure == "off" && choices.white_balance == "on") {
    throw UserError(
        "Failed to parse options - --Effects.white_balance on needs exposure, which "
        "--Effects.exposure off forbids; give one of the two.");
  }
  EffectsOptions options;
  options.exposure = ToSwitch(choices.exposure);
  options.white_balance = ToSwitch(choices.white_balance);
  options.vignetting = ToSwitch(choices.vignetting);
  // Fields hold a gain for each photo.
  options.shading = choices.exposure == "off" && choices.shading == "auto"
                        ? EffectSwitch::kOff
                        : ToSwitch(choices.shading);
  options.poses = ToSwitch(choices.poses);
  options.blur = choices.blur == "auto";
  options.transients = choices.transients == "auto";
  options.sky = choices.sky == "auto";
  options.distortion = ToSwitch(choices.distortion);
  options.semantics = choices.semantics == "auto";
  options.fixed_sh_degree = choices.sh_degree == "on";
  return options;
}

}  // namespace semfoam
