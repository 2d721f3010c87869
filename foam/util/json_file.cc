// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/util/json_file.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"

#include <limits>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using Json = nlohmann::json;

constexpr int kMaxDepth = 64;

// Whether to keep a value that has been read.
using Keep = std::function<bool(int depth, Json::parse_event_t event, const Json& value)>;

Json Parse(const std::filesystem::path& path, std::string_view text, const Keep& keep) {
  // Of the objects that are open at the moment, the outermost first.
  std::vector<std::set<std::string>> keys;
  const auto check = [&](int depth, Json::parse_event_t event, const Json& value) {
    if (depth > kMaxDepth) {
      throw UserError(path.string(),
                      ": is nested deeper than ",
                      kMaxDepth,
                      " levels, where a few would be right; is it damaged?");
    }
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event == Json::parse_event_t::key &&
        !keys.back().insert(value.get_ref<const std::string&>()).second) {
      throw UserError(path.string(),
                      ": gives \"",
                      Shortened(value.get_ref<const std::string&>()),
                      "\" twice in one place; once would be right.");
    }
    return keep(depth, event, value);
  };
  try {
    return Json::parse(text, check);
  } catch (const Json::parse_error& error) {
    if (error.byte > text.size()) {
      throw UserError(path.string(),
                      ": ends after ",
                      text.size(),
                      " bytes, before its JSON does; is the copy complete?");
    }
    throw UserError(path.string(),
                    ": is no valid JSON from byte ",
                    error.byte,
                    " of ",
                    text.size(),
                    " on; a complete JSON file would be right.");
  } catch (const Json::out_of_range&) {
    throw UserError(path.string(),
                    ": has a number beyond ",
                    std::numeric_limits<double>::max(),
                    ", which a double does not hold; is it damaged?");
  }
}

}  // namespace

Json ParseJson(const std::filesystem::path& path, std::string_view text) {
  return Parse(path, text, [](int, Json::parse_event_t, const Json&) { return true; });
}

Json ReadJsonFile(
    const std::filesystem::path& path,
    const std::string& key,
    const std::function<void(const nlohmann::json& element, size_t index)>& on_element) {
  const int depth_of_elements = key.empty() ? 1 : 2;
  std::string root_key;
  size_t index = 0;
  const auto keep = [&](int depth, Json::parse_event_t event, const Json& value) {
    if (event == Json::parse_event_t::key && depth == 1 && !key.empty()) {
      root_key = value.get_ref<const std::string&>();
    }
    if (event != Json::parse_event_t::object_end || depth != depth_of_elements || root_key != key) {
      return true;
    }
    on_element(value, index++);
    return false;
  };
  return Parse(path, ReadFileBytes(path, "a JSON file"), keep);
}

Json ReadJsonFile(const std::filesystem::path& path) {
  return ParseJson(path, ReadFileBytes(path, "a JSON file"));
}

std::optional<int64_t> JsonInteger(const Json& value, int64_t low, int64_t high) {
  if (!value.is_number_integer()) return std::nullopt;
  if (value.is_number_unsigned() &&
      value.get<uint64_t>() > static_cast<uint64_t>(std::numeric_limits<int64_t>::max())) {
    return std::nullopt;
  }
  const auto number = value.get<int64_t>();
  if (number < low || number > high) return std::nullopt;
  return number;
}

}  // namespace semfoam
