// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/effects_report.h"

#include "foam/util/error.h"
#include "foam/util/json_file.h"
#include "foam/util/output_file.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using nlohmann::ordered_json;

std::string State(const Effect& effect, const SceneEffects& effects) {
  std::string state = effect.name == "sh_degree" ? std::to_string(effects.sh_degree)
                      : effect.on                ? "on"
                                                 : "off";
  if (effect.by_option) state += " (option)";
  return state;
}

// The coefficients of each channel.
template <typename Matrix>
ordered_json Rows(const Matrix& matrix) {
  ordered_json rows = ordered_json::array();
  for (int c = 0; c < matrix.rows(); ++c) {
    ordered_json row = ordered_json::array();
    for (int k = 0; k < matrix.cols(); ++k) row.push_back(matrix(c, k));
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

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

std::string EffectsJson(const SceneEffects& effects, const std::vector<PhotoRecord>& photos) {
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
                                         {"shading", Rows(light.shading)},
                                         {"tone", Rows(light.tone)},
                                         {"lens", effects.lenses[view]},
                                         {"held_out", photos[view].held_out}};
  }
  // Names that are no UTF-8 become U+FFFD instead of an exception.
  return json.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

void WriteEffects(const std::filesystem::path& path,
                  const SceneEffects& effects,
                  const std::vector<PhotoRecord>& photos) {
  WriteTextFile(path, EffectsJson(effects, photos));
}

PhotoLights ReadLights(const std::filesystem::path& path, const std::vector<PhotoRecord>& photos) {
  if (!std::filesystem::exists(path)) return {};
  const nlohmann::json json = ReadJsonFile(path);
  if (!json.is_object() || !json.contains("photos")) return {};
  PhotoLights read{std::vector<PhotoLight>(photos.size()), std::vector<int>(photos.size(), -1)};
  try {
    if (!json.at("photos").is_object()) throw UserError("its photos are no table by name");
    for (size_t view = 0; view < photos.size(); ++view) {
      const auto photo = json.at("photos").find(photos[view].name);
      if (photo == json.at("photos").end()) continue;
      PhotoLight& light = read.lights[view];
      // Files of earlier versions have neither.
      read.lenses[view] = photo->value("lens", 0);
      for (int i = 0; i < 9 && photo->contains("tone"); ++i) {
        light.tone(i / 3, i % 3) = photo->at("tone").at(i / 3).at(i % 3).get<double>();
      }
      for (int c = 0; c < 3; ++c) {
        light.gain[c] = photo->at("gain").at(c).get<double>();
        for (int k = 0; k < kNumShadingTerms; ++k) {
          light.shading(c, k) = photo->at("shading").at(c).at(k).get<double>();
        }
      }
      for (int k = 0; k < 2; ++k) light.falloff[k] = photo->at("falloff").at(k).get<double>();
      if (!(light.gain.minCoeff() > 0)) throw UserError("a gain is not positive");
      if (!(light.tone.determinant() > 0)) throw UserError("a tone cannot be undone");
    }
  } catch (const std::exception& error) {
    throw UserError(path.string(),
                    ": is no table of effects of this version (",
                    error.what(),
                    "); the file that the training wrote would be right, or none.");
  }
  return read;
}

bool AdaptsLight(const Model& model) {
  return model.options.contains("exposure") || model.options.contains("shading");
}

void CopyLight(const Model& model,
               const std::filesystem::path& foam_path,
               const std::filesystem::path& edited_path) {
  namespace fs = std::filesystem;
  const fs::path from = foam_path.parent_path() / "effects.json";
  const fs::path to = edited_path.parent_path() / "effects.json";
  std::error_code error;
  if (fs::equivalent(from, to, error)) return;
  if (!AdaptsLight(model) || !fs::exists(from)) {
    if (fs::remove(to, error)) {
      LOG(INFO) << "Removed " << to.string() << ", which is of another foam";
    }
    if (!error) return;
    throw UserError(to.string(),
                    ": is of another foam and cannot be removed (",
                    error.message(),
                    "); a folder without it would be right.");
  }
  std::ifstream file(from, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) {
    throw UserError(from.string(), ": cannot be read; the light of the photos is in it.");
  }
  WriteTextFile(to, text.str());
}

std::optional<ExpectedLights> FindExpectedLights(const std::filesystem::path& foam_path,
                                                 const Model& model) {
  const std::filesystem::path path = foam_path.parent_path() / "effects.json";
  PhotoLights read = ReadLights(path, model.photos);
  if (read.lights.empty()) {
    LOG_IF(WARNING, AdaptsLight(model))
        << path.string()
        << ": there is no light of photos, although this foam was trained with it; views are "
           "rendered in the reference exposure. The file that the training wrote, beside the foam, "
           "would be right.";
    return std::nullopt;
  }
  return ExpectedLights(model.photos, read.lenses, std::move(read.lights));
}

}  // namespace semfoam
