// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/options/json_option.h"

#include <cstdio>
#include <string>

#include <nlohmann/json.hpp>

namespace semfoam {

void AddJsonOption(OptionManager* options, bool* json) {
  options->AddDefaultOption("json", json, "1 = print the whole report as JSON, not as text");
}

void PrintJson(const nlohmann::ordered_json& json) {
  const std::string text =
      json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  std::printf("%s\n", text.c_str());
}

}  // namespace semfoam
