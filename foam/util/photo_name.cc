// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/photo_name.h"

#include <algorithm>
#include <filesystem>

#include <nlohmann/json.hpp>

namespace semfoam {

bool StaysBelowFolder(const std::string& name) {
  const std::filesystem::path path(name);
  return !path.is_absolute() && path.has_filename() && path.filename() != "." &&
         name.find('\0') == std::string::npos &&
         std::find(path.begin(), path.end(), "..") == path.end();
}

bool IsUtf8(const std::string& name) {
  try {
    nlohmann::json(name).dump();
    return true;
  } catch (const nlohmann::json::type_error&) {
    return false;
  }
}

}  // namespace semfoam
