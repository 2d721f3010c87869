// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/label_names.h"

#include "export/scene/names.h"
#include "foam/util/error.h"
#include "foam/util/json_file.h"
#include "plugin/mask/label_naming.h"
#include "plugin/mask/mask_tables.h"
#include "tools/controllers/export_record.h"
#include "tools/support/value_text.h"

#include <algorithm>
#include <map>
#include <optional>
#include <system_error>
#include <vector>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

// The record in a folder; nothing where there is none. Warns of a file that cannot be read.
std::optional<ExportRecord> FindRecord(const fs::path& folder) {
  const fs::path file = folder / "labels.json";
  if (!fs::is_regular_file(file)) return std::nullopt;
  try {
    ReadJsonFile(file);
  } catch (const UserError& error) {
    LOG(WARNING) << error.what() << " Names in it are not taken.";
    return std::nullopt;
  }
  try {
    return ReadExportRecord(folder);
  } catch (const UserError&) {
    // Names that a user wrote for the masks, say.
    return std::nullopt;
  }
}

// "6 is mug", for a list.
std::string Is(LabelId id, const std::string& name) {
  return std::to_string(Value(id)) + " is " + name;
}

// The names that people changed in the record of `file`, by id.
std::map<LabelId, std::string> EditedNames(const fs::path& file,
                                           const ExportRecord& record,
                                           const std::string& foam_checksum,
                                           const std::vector<Label>& labels) {
  if (!record.foam_checksum.empty() && record.foam_checksum != foam_checksum) return {};
  std::map<LabelId, std::string> edited;
  std::vector<std::string> taken, unknown, misplaced;
  for (const auto& [id, name] : record.label_names) {
    const auto label = std::find_if(labels.begin(), labels.end(), [id = id](const Label& l) {
      return l.id == id && id != kNoObject;
    });
    if (label == labels.end()) {
      unknown.push_back(Is(id, name));
    } else if (name != DisplayName(id, label->name)) {
      edited[id] = name;
      taken.push_back(Is(id, DisplayName(id, name)));
    }
  }
  for (const auto& [id, name] : record.object_names) {
    const auto in_table = record.label_names.find(id);
    if (in_table != record.label_names.end() && name != DisplayName(id, in_table->second) &&
        edited.count(id) == 0) {
      misplaced.push_back(Is(id, name));
    }
  }
  if (record.foam_checksum.empty()) {
    if (!taken.empty()) {
      LOG(WARNING) << file.string() << " does not say of which foam its names are, so they are not "
                   << "taken (" << Joined(taken) << "); labels_path takes them.";
    }
    return {};
  }
  if (!taken.empty()) LOG(INFO) << "Names from " << file.string() << ": " << Joined(taken);
  if (!unknown.empty()) {
    LOG(WARNING) << file.string()
                 << " names labels that the foam does not have: " << Joined(unknown) << ".";
  }
  if (!misplaced.empty()) {
    LOG(WARNING) << file.string() << " has other names under \"objects\" (" << Joined(misplaced)
                 << "); names are taken from \"labels\" alone.";
  }
  return edited;
}

}  // namespace

void TakeLabelNames(const fs::path& foam_path,
                    const fs::path& output_path,
                    const std::string& labels_path,
                    Model* model) {
  std::vector<fs::path> folders;
  if (!output_path.empty()) folders.push_back(output_path);
  const fs::path beside = foam_path.has_parent_path() ? foam_path.parent_path() : fs::path(".");
  std::error_code ignored;
  if (output_path.empty() || !fs::equivalent(output_path, beside, ignored)) {
    folders.push_back(beside);
  }
  const std::string checksum = ModelChecksum(foam_path);
  std::map<LabelId, std::string> names;
  for (const fs::path& folder : folders) {
    const std::optional<ExportRecord> record = FindRecord(folder);
    if (!record) continue;
    const fs::path file = folder / "labels.json";
    for (const auto& [id, name] : EditedNames(file, *record, checksum, model->labels)) {
      const auto [first, is_first] = names.emplace(id, name);
      if (is_first || first->second == name) continue;
      LOG(WARNING) << "Label " << Is(id, first->second) << " by "
                   << (folders.front() / "labels.json").string() << ", not " << name << ", as "
                   << file.string() << " has it; labels_path chooses.";
    }
  }
  for (Label& label : model->labels) {
    if (const auto name = names.find(label.id); name != names.end()) label.name = name->second;
  }
  if (labels_path.empty()) return;
  const fs::path file = FindLabelsFile(labels_path, {});
  NameLabels(file, &model->labels);
  if (const std::string warning = UnusedNamesWarning(file, model->labels); !warning.empty()) {
    LOG(WARNING) << warning;
  }
}

Model ReadNamedModel(const fs::path& foam_path,
                     const fs::path& output_path,
                     const std::string& labels_path) {
  Model model = ReadModel(foam_path);
  TakeLabelNames(foam_path, output_path, labels_path, &model);
  return model;
}

void WarnOfOtherNames(const fs::path& output_path, const std::string& labels_path) {
  if (labels_path.empty()) return;
  const fs::path foam_path = output_path / "scene.foam";
  const std::vector<Label> before = ReadNamedModel(foam_path).labels;
  std::vector<Label> after = before;
  NameLabels(FindLabelsFile(labels_path, {}), &after);
  std::vector<std::string> other;
  for (size_t k = 0; k < before.size(); ++k) {
    const std::string name = DisplayName(after[k].id, after[k].name);
    if (name != DisplayName(before[k].id, before[k].name)) other.push_back(Is(after[k].id, name));
  }
  if (other.empty()) return;
  LOG(WARNING) << "A finished run takes no new names (" << Joined(other)
               << "): mesh_exporter and volume_exporter, with foam_path " << foam_path.string()
               << ", output_path " << output_path.string() << " and labels_path " << labels_path
               << ", write its objects under them.";
}

}  // namespace semfoam
