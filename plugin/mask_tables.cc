// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask_tables.h"

#include "foam/error.h"
#include "foam/input_file.h"
#include "foam/json_file.h"

#include <charconv>
#include <system_error>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using Json = nlohmann::json;

constexpr int64_t kLargestId = 0xffffff;  // three bytes of a colour

// The array that `json` has under `key`.
const Json& ArrayOf(const std::filesystem::path& file, const Json& json, const char* key) {
  if (json.is_object() && json.contains(key) && json[key].is_array()) return json[key];
  throw UserError(file.string(),
                  ": is not as DEVA writes it (no list \"",
                  key,
                  "\" where one belongs); annotations, each with segments_info, each with an id, "
                  "would be right.");
}

}  // namespace

std::set<uint32_t> ReadPredictedIds(const std::filesystem::path& file) {
  const Json json = ReadJsonFile(file);
  std::set<uint32_t> ids;
  for (const Json& annotation : ArrayOf(file, json, "annotations")) {
    for (const Json& segment : ArrayOf(file, annotation, "segments_info")) {
      const bool has_id = segment.is_object() && segment.contains("id");
      const auto id = has_id ? JsonInteger(segment["id"], 0, kLargestId) : std::nullopt;
      if (!id) {
        throw UserError(
            file.string(),
            ": is not as DEVA writes it (",
            has_id ? "the id " + Shortened(segment["id"].dump()) : "a segment without id",
            "); an id from 0 to ",
            kLargestId,
            " for each segment would be right.");
      }
      ids.insert(static_cast<uint32_t>(*id));
    }
  }
  return ids;
}

std::map<uint32_t, std::string> ReadLabelNames(const std::filesystem::path& file) {
  const Json json = ReadJsonFile(file);
  if (!json.is_object() || !json.contains("labels") || !json["labels"].is_object()) {
    throw UserError(file.string(),
                    ": has no \"labels\"; {\"labels\": {\"7\": \"mug\"}} would be right.");
  }
  std::map<uint32_t, std::string> names;
  for (const auto& [key, value] : json["labels"].items()) {
    uint32_t id = 0;
    const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), id);
    if (error != std::errc() || end != key.data() + key.size() || !value.is_string()) {
      throw UserError(file.string(),
                      ": the label \"",
                      Shortened(key),
                      "\" is not as in {\"labels\": {\"7\": \"mug\"}}, an id with a name.");
    }
    if (!names.emplace(id, value.get<std::string>()).second) {
      throw UserError(
          file.string(), ": names the label ", id, " twice; one name for each id would be right.");
    }
  }
  return names;
}

}  // namespace semfoam
