// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/mask/mask_folder_writer.h"

#include "foam/util/error.h"
#include "foam/util/json_file.h"
#include "foam/util/output_file.h"
#include "plugin/mask/label_png.h"
#include "plugin/mask/mask_folders.h"
#include "plugin/mask/mask_tables.h"

#include <set>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLabelsFile = "labels.json";

bool IsOfOrigin(const fs::path& labels_file, const MaskOrigin& origin) {
  if (!fs::is_regular_file(labels_file)) return false;
  try {
    return ReadJsonFile(labels_file).contains(origin.key);
  } catch (const UserError&) {
    return false;
  }
}

// Throws UserError where files would be lost, or would be taken for masks of this set. Returns the
// folder.
const fs::path& RequireRoom(const fs::path& folder,
                            const MaskOrigin& origin,
                            const std::vector<std::string>& mask_names) {
  const fs::path labels_file = folder / kLabelsFile;
  const bool is_own = IsOfOrigin(labels_file, origin);
  if (fs::exists(labels_file) && !is_own) {
    throw UserError(labels_file.string(),
                    ": was not written by ",
                    origin.description,
                    " and would be lost; a folder of their own would be right for these masks.");
  }
  const std::set<std::string> names(mask_names.begin(), mask_names.end());
  for (const auto& [name, path] : ListMasks(folder)) {
    if (is_own && names.contains(name)) continue;
    throw UserError(path.string(),
                    ": is not of these masks and would be mixed up with them; a folder of their "
                    "own would be right.");
  }
  return folder;
}

void Move(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::create_directories(to.parent_path(), error);
  const int failure = error ? error.value() : MoveOutOfScratch(from, to);
  if (failure == 0) return;
  throw UserError(to.string(),
                  ": cannot be written (",
                  std::generic_category().message(failure),
                  "); is a folder of that name in the way?");
}

std::string LabelsJson(const MaskOrigin& origin, const MaskTable& table) {
  nlohmann::ordered_json json;
  json["version"] = 1;
  json[origin.key] = table.made_from;
  if (table.zero_is_unlabelled) json[kLabelZeroKey] = kLabelZeroIgnored;
  json["labels"] = nlohmann::ordered_json::object();
  for (const auto& [id, name] : table.labels) json["labels"][std::to_string(id)] = name;
  for (const auto& [id, original] : table.original_ids) {
    json["original_ids"][std::to_string(id)] = original;
  }
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace

MaskFolderWriter::MaskFolderWriter(const fs::path& folder,
                                   const MaskOrigin& origin,
                                   std::vector<std::string> names)
    : folder_(folder),
      origin_(origin),
      names_(std::move(names)),
      scratch_(RequireRoom(folder_, origin_, names_)) {}

void MaskFolderWriter::Write(size_t index, const LabelImage& ids) const {
  WriteLabelPng(scratch_.path() / names_[index], ids);
}

void MaskFolderWriter::Finish(const MaskTable& table) const {
  for (const std::string& name : names_) Move(scratch_.path() / name, folder_ / name);
  WriteTextFile(folder_ / kLabelsFile, LabelsJson(origin_, table));
}

}  // namespace semfoam
