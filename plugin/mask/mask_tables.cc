// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_tables.h"

#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/json_file.h"
#include "plugin/util/files.h"

#include <charconv>
#include <limits>
#include <map>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

using Json = nlohmann::json;

constexpr int64_t kLargestId = 0xffffff;  // three bytes of a colour

// Returns the array that `json` has under `key`.
const Json& ArrayOf(const fs::path& file, const Json& json, const char* key) {
  if (json.is_object() && json.contains(key) && json[key].is_array()) return json[key];
  throw UserError(file.string(),
                  ": is not as DEVA writes it (no list \"",
                  key,
                  "\" where one belongs); annotations, each with segments_info, each with an id, "
                  "would be right.");
}

// The id that a key of a table is; none where it is none.
std::optional<uint32_t> IdOf(std::string_view key) {
  uint32_t id = 0;
  const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), id);
  if (error != std::errc() || end != key.data() + key.size()) return std::nullopt;
  return id;
}

}  // namespace

fs::path FindPredictions(const fs::path& mask_folder) {
  for (const fs::path& file : {mask_folder / "pred.json",
                               fs::absolute(mask_folder).lexically_normal() / ".." / "pred.json"}) {
    if (fs::exists(file)) return file;
  }
  return {};
}

std::set<MaskId> ReadPredictedIds(const fs::path& file) {
  const Json json = ReadJsonFile(file);
  std::set<MaskId> ids;
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
      ids.insert(static_cast<MaskId>(*id));
    }
  }
  return ids;
}

fs::path FindLabelsFile(const fs::path& labels_path, const fs::path& mask_folder) {
  if (labels_path.empty()) {
    if (mask_folder.empty()) return {};
    for (const fs::path& folder : {mask_folder, ParentFolder(mask_folder)}) {
      if (fs::is_regular_file(folder / "labels.json")) return folder / "labels.json";
    }
    return {};
  }
  if (fs::is_regular_file(labels_path)) return labels_path;
  throw UserError(labels_path.string(),
                  ": there is no such file; {\"labels\": {\"7\": \"mug\"}} should be in it.");
}

bool SaysZeroIsUnlabelled(const fs::path& mask_folder) {
  const fs::path file = mask_folder / "labels.json";
  if (!fs::is_regular_file(file)) return false;
  const Json json = ReadJsonFile(file);
  return json.is_object() && json.value(kLabelZeroKey, Json()) == kLabelZeroIgnored;
}

std::vector<LabelName> ReadLabelNames(const fs::path& file) {
  const Json json = ReadJsonFile(file);
  if (!json.is_object() || !json.contains("labels") || !json["labels"].is_object()) {
    throw UserError(file.string(),
                    ": has no \"labels\"; {\"labels\": {\"7\": \"mug\"}} would be right.");
  }
  std::map<uint32_t, LabelName> names;
  for (const auto& [key, value] : json["labels"].items()) {
    const std::optional<uint32_t> id = IdOf(key);
    if (!id || !value.is_string()) {
      throw UserError(file.string(),
                      ": the label \"",
                      Shortened(key),
                      "\" is not as in {\"labels\": {\"7\": \"mug\"}}, an id with a name.");
    }
    const LabelName name{static_cast<LabelId>(*id), MaskId{*id}, value.get<std::string>()};
    if (!names.emplace(*id, name).second) {
      throw UserError(
          file.string(), ": names the label ", *id, " twice; one name for each id would be right.");
    }
  }
  if (json.contains("source_ids")) {
    const Json& source_ids = json["source_ids"];
    if (!source_ids.is_object()) {
      throw UserError(file.string(),
                      ": its \"source_ids\" are not as in {\"source_ids\": {\"7\": 81234}}, ids of "
                      "the masks for ids of its labels.");
    }
    for (const auto& [key, value] : source_ids.items()) {
      const std::optional<uint32_t> id = IdOf(key);
      const auto source_id = JsonInteger(value, 0, std::numeric_limits<uint32_t>::max());
      if (!id || !source_id) {
        throw UserError(file.string(),
                        ": the source id of \"",
                        Shortened(key),
                        "\" is not as in {\"source_ids\": {\"7\": 81234}}, an id of the masks for "
                        "an id of its labels.");
      }
      const auto name = names.find(*id);
      if (name != names.end()) name->second.source_id = static_cast<MaskId>(*source_id);
    }
  }
  std::vector<LabelName> table;
  table.reserve(names.size());
  for (auto& [id, name] : names) table.push_back(std::move(name));
  return table;
}

}  // namespace semfoam
