// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace semfoam {

// Parses `text`. `path` is for messages. Throws UserError, one sentence that names the file and the
// place, where the text is no JSON, has a key twice, has a number that a double cannot hold, or is
// nested deeper than 64 levels, which would overflow the stack of the recursive parser.
nlohmann::json ParseJson(const std::filesystem::path& path, std::string_view text);

// Reads and parses a file: ReadFileBytes, then ParseJson.
nlohmann::json ReadJsonFile(const std::filesystem::path& path);

// Reads a file whose root is an object, and hands the objects in the root's list `key` to
// `on_element(element, index)`, one after another in their order: they are not kept, so that long
// lists take the memory of one element. The result has an empty list in their place. With an empty
// key, the list is the root itself.
nlohmann::json ReadJsonFile(
    const std::filesystem::path& path,
    const std::string& key,
    const std::function<void(const nlohmann::json& element, size_t index)>& on_element);

// Returns `value` as a whole number if it is written as one (7, not 7.0 or 7.5) and lies in [low,
// high]; otherwise nothing.
std::optional<int64_t> JsonInteger(const nlohmann::json& value, int64_t low, int64_t high);

}  // namespace semfoam
