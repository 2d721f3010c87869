// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/effects_options.h"

#include "foam/util/error.h"
#include "foam/util/output_file.h"

#include <algorithm>
#include <cstdio>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using nlohmann::ordered_json;

EffectSwitch ToSwitch(const std::string& text) {
  return text == "on"    ? EffectSwitch::kOn
         : text == "off" ? EffectSwitch::kOff
                         : EffectSwitch::kAuto;
}

std::string State(const Effect& effect, const SceneEffects& effects) {
  std::string state = effect.name == "sh_degree" ? std::to_string(effects.sh_degree)
                      : effect.on                ? "on"
                                                 : "off";
  if (effect.by_option) state += " (option)";
  return state;
}

}  // namespace

void AddEffectsOptions(OptionManager* options, EffectsChoices* choices) {
  const auto add = [options](const std::string& name, std::string* value, const std::string& help) {
    options->AddChoiceOption("Effects." + name, value, {"auto", "on", "off"}, help);
  };
  add("exposure", &choices->exposure, "a gain for each photo; auto = what the tracks show");
  add("white_balance", &choices->white_balance, "three gains for each photo; likewise");
  add("vignetting", &choices->vignetting, "a falloff towards the corners; likewise");
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
  options.distortion = ToSwitch(choices.distortion);
  options.semantics = choices.semantics == "auto";
  options.fixed_sh_degree = choices.sh_degree == "on";
  return options;
}

std::vector<std::string> EffectsTable(const SceneEffects& effects) {
  size_t width = 0;
  for (const Effect& effect : effects.effects) width = std::max(width, effect.evidence.size());
  const auto line = [width](const std::string& name,
                            const std::string& state,
                            std::string evidence,
                            const std::string& cost) {
    char text[64];
    std::snprintf(text, sizeof(text), "%-14s %-12s ", name.c_str(), state.c_str());
    evidence.resize(width, ' ');
    return text + evidence + "  " + cost;
  };
  std::vector<std::string> lines = {line("effect", "on/off", "evidence", "what it costs")};
  for (const Effect& effect : effects.effects) {
    lines.push_back(line(effect.name, State(effect, effects), effect.evidence, effect.cost));
  }
  return lines;
}

void WriteEffects(const std::filesystem::path& path,
                  const SceneEffects& effects,
                  const std::vector<PhotoRecord>& photos) {
  ordered_json json = {{"version", 1}, {"effects", ordered_json::array()}};
  for (const Effect& effect : effects.effects) {
    json["effects"].push_back({{"effect", effect.name},
                               {"on", effect.on},
                               {"decided_by", effect.by_option ? "option" : "probe"},
                               {"evidence", effect.evidence},
                               {"measures", effect.measures},
                               {"cost", effect.cost}});
  }
  json["sh_degree"] = effects.sh_degree;
  for (size_t view = 0; view < effects.lights.size(); ++view) {
    const PhotoLight& light = effects.lights[view];
    json["photos"][photos[view].name] = {{"gain", {light.gain[0], light.gain[1], light.gain[2]}},
                                         {"falloff", {light.falloff[0], light.falloff[1]}},
                                         {"held_out", photos[view].held_out}};
  }
  // Names that are no UTF-8 become U+FFFD instead of an exception.
  WriteTextFile(path, json.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n");
}

}  // namespace semfoam
