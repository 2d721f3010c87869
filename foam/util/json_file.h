// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace semfoam {

// The value that `text` holds. `path` is for messages. Throws UserError, one sentence that names
// the file and the place, where it is no JSON, gives a key twice, has a number that a double cannot
// hold, or is nested deeper than 64 levels, which no file of ours is and recursion does not bear.
nlohmann::json ParseJson(const std::filesystem::path& path, std::string_view text);

// The value that a file holds: ReadFileBytes, then ParseJson.
nlohmann::json ReadJsonFile(const std::filesystem::path& path);

// The whole number that `value` is, as it stands in the file (7, not 7.0 or 7.5); none where it is
// no such, or outside of [low, high].
std::optional<int64_t> JsonInteger(const nlohmann::json& value, int64_t low, int64_t high);

}  // namespace semfoam
