// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/export_record.h"

#include "export/io/label_sidecar.h"
#include "foam/util/error.h"
#include "foam/util/json_file.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <set>
#include <system_error>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr int kLargestId = 65535;

// Key in labels.json and path of every file of a whole scene, and of an object: the order in which
// labels.json lists them.
struct ExportName {
  const char* format;
  const char* name;
};
constexpr ExportName kSceneFiles[] = {{"vdb", "scene.vdb"},
                                      {"nvdb", "scene.nvdb"},
                                      {"vdb_labels_int32", "scene_labels_int32.vdb"},
                                      {"nvdb_labels_int32", "scene_labels_int32.nvdb"},
                                      {"vdb_points", "scene_points.vdb"},
                                      {"om", "scene.om"},
                                      {"ply", "scene.ply"},
                                      {"obj", "scene.obj"},
                                      {"mtl", "scene.mtl"},
                                      {"png", "scene.png"},
                                      {"jpg", "scene.jpg"},
                                      {"glb", "scene.glb"},
                                      {"usda", "scene.usda"},
                                      {kEmbeddingsFormat, kEmbeddingsFile}};
constexpr const char* kObjectFormats[] = {
    "vdb", "nvdb", "om", "ply", "obj", "mtl", "png", "jpg", "glb"};

// Returns whether an export of these formats writes a file of this one anew, or refers to it no
// more.
bool IsReplaced(const std::string& format, const std::set<ExportFormat>& formats) {
  if (format == "png" || format == "jpg") return TakesTextures(formats);
  // Is in no frame, and written with every labels.json.
  if (format == kEmbeddingsFormat) return true;
  const std::optional<ExportFormat> writer =
      ParseEnum(kExportFormatNames, format == "mtl" ? "obj" : format);
  return writer && formats.count(*writer) != 0;
}

// Returns whether exports write to this path. Other paths, in a labels.json that was edited, are
// never removed.
bool IsExportPath(const std::string& path) {
  for (const ExportName& file : kSceneFiles) {
    if (path == file.name) return true;
  }
  const std::string folder = "objects/";
  const size_t dot = path.rfind('.');
  if (!path.starts_with(folder) || dot == std::string::npos) return false;
  const std::string stem = path.substr(folder.size(), dot - folder.size());
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  return !stem.empty() && is_digit(stem[0]) && std::all_of(stem.begin(), stem.end(), [&](char c) {
    return is_digit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '-';
  }) && std::count(std::begin(kObjectFormats), std::end(kObjectFormats), path.substr(dot + 1)) > 0;
}

void AddFiles(const Json& owner,
              LabelId object_id,
              const fs::path& output_path,
              ExportRecord* record) {
  const auto files = owner.find("files");
  if (files == owner.end() || !files->is_object()) return;
  for (const auto& [format, path] : files->items()) {
    if (!path.is_string() || !IsExportPath(path.get<std::string>())) continue;
    if (!fs::exists(output_path / path.get<std::string>())) continue;
    record->files.push_back({object_id, format, path.get<std::string>()});
  }
}

// "objects/7_mug.ply" and "objects/7_mug.obj" as one text, "objects/7_mug.ply, .obj".
std::vector<std::string> TogetherByStem(const std::vector<std::string>& paths) {
  std::vector<std::string> stems, lines;
  for (const std::string& path : paths) {
    const std::string stem = path.substr(0, path.rfind('.'));
    const auto found = std::find(stems.begin(), stems.end(), stem);
    if (found == stems.end()) {
      stems.push_back(stem);
      lines.push_back(path);
    } else {
      lines[found - stems.begin()] += ", " + path.substr(stem.size());
    }
  }
  return lines;
}

void Remove(const fs::path& output_path,
            const std::vector<std::string>& paths,
            const std::string& why) {
  std::vector<std::string> removed;
  for (const std::string& path : paths) {
    std::error_code error;
    fs::remove(output_path / path, error);
    if (error) {
      LOG(WARNING) << (output_path / path).string() << ": " << why << ", and cannot be removed ("
                   << error.message() << "); labels.json does not list it.";
    } else {
      removed.push_back(path);
    }
  }
  for (const std::string& line : TogetherByStem(removed)) {
    LOG(WARNING) << "Removed " << line << ": " << why << ".";
  }
  std::error_code not_empty;
  if (!removed.empty()) fs::remove(output_path / "objects", not_empty);
}

// Returns all files that the scene may have in an output folder, in the order in which labels.json
// lists them.
std::vector<WrittenFile> PossibleFiles(const ExportableScene& scene) {
  std::vector<WrittenFile> files;
  for (const ExportName& file : kSceneFiles)
    files.push_back({kNoObject, file.format, file.name, ""});
  for (const ObjectInfo& object : scene.objects) {
    for (const std::string format : kObjectFormats) {
      files.push_back({object.id, format, "objects/" + object.file_stem + "." + format, ""});
    }
  }
  return files;
}

// The files of an older record that the finished export did not write, by what happens to them.
struct OlderFiles {
  // Of the same foam, objects and frame: listed again.
  std::vector<std::string> kept;
  // Of another foam, of other objects, in another frame: removed.
  std::vector<std::string> other_foam;
  std::vector<std::string> other_objects;
  std::vector<std::string> other_frame;
  // Of an unknown foam: they stay, and are listed no more.
  std::vector<std::string> unknown_foam;
};

// Classifies the record's files other than `written`. `possible` are the paths that the scene may
// have, and `object_names` are those of its objects.
OlderFiles SortOlderFiles(const ExportRecord& record,
                          const FinishedExport& finished,
                          bool is_same_frame,
                          const std::set<std::string>& possible,
                          const std::set<std::string>& written,
                          const std::map<LabelId, std::string>& object_names) {
  const auto name_in = [](const std::map<LabelId, std::string>& names, LabelId id) {
    const auto name = names.find(id);
    return name == names.end() ? std::string() : name->second;
  };
  const auto has_same_objects = [&](const std::string& path, LabelId object_id) {
    if (possible.count(path) == 0) return false;
    if (object_id != kNoObject) {
      return name_in(object_names, object_id) == name_in(record.object_names, object_id);
    }
    // The meshes of the scene hold all objects by name; its volumes hold ids.
    return (path != "scene.glb" && path != "scene.usda") || object_names == record.object_names;
  };
  const bool is_same_foam = record.foam_checksum == finished.foam_checksum;
  OlderFiles older;
  for (const auto& [object_id, format, path] : record.files) {
    if (written.count(path) != 0) {
      continue;
    } else if (!is_same_foam && (finished.is_new_foam || !record.foam_checksum.empty())) {
      older.other_foam.push_back(path);
    } else if (!is_same_foam) {
      older.unknown_foam.push_back(path);
    } else if (!has_same_objects(path, object_id)) {
      older.other_objects.push_back(path);
    } else if (!is_same_frame) {
      older.other_frame.push_back(path);
    } else {
      older.kept.push_back(path);
    }
  }
  return older;
}

// Warns where a new foam's objects have other names than the labels of the foam before had.
void WarnOfReplacedNames(const ExportRecord& record,
                         const std::map<LabelId, std::string>& object_names) {
  std::string other_names;
  for (const auto& [id, name] : object_names) {
    const auto before = record.label_names.find(id);
    if (before == record.label_names.end() || before->second == name) continue;
    if (!other_names.empty()) other_names += ", ";
    other_names += std::to_string(Value(id)) + " was " + before->second + ", is " + name;
  }
  if (!other_names.empty()) {
    LOG(WARNING) << "The labels.json of the foam before had other names: " << other_names << ".";
  }
}

// Warns of files that stay and are listed no more.
void WarnOfUnlisted(const fs::path& output_path, const std::vector<std::string>& paths) {
  if (paths.empty()) return;
  std::string text;
  for (const std::string& line : TogetherByStem(paths)) text += (text.empty() ? "" : "; ") + line;
  LOG(WARNING) << "The labels.json that was in " << output_path.string()
               << " does not say of which foam its files are: these stay and are listed no more: "
               << text;
}

}  // namespace

std::string ModelChecksum(const std::filesystem::path& foam_path) {
  uint64_t checksum = 0;
  std::ifstream file(foam_path, std::ios::binary);
  file.seekg(-static_cast<std::streamoff>(sizeof(checksum)), std::ios::end);
  file.read(reinterpret_cast<char*>(&checksum), sizeof(checksum));
  if (!file) throw UserError(foam_path.string(), ": cannot be read.");
  char text[17];
  std::snprintf(text, sizeof(text), "%016llx", static_cast<unsigned long long>(checksum));
  return text;
}

std::optional<ExportRecord> ReadExportRecord(const fs::path& output_path) {
  const fs::path path = output_path / "labels.json";
  if (fs::is_directory(path)) {
    throw UserError(path.string(),
                    ": is a folder, in the way of the file of that name; choose another ",
                    Field{"output_path"},
                    ".");
  }
  if (!fs::is_regular_file(path)) return std::nullopt;
  Json json = ReadJsonFile(path);
  // Every labels.json of an export has a frame and objects; a table of names that a user wrote does
  // not.
  if (!json.is_object() || !json.contains("frame") || !json.contains("objects")) {
    throw UserError(path.string(),
                    ": was not written by an export and would be lost; choose another ",
                    Field{"output_path"},
                    ".");
  }
  if (json.contains("version") && json["version"] != kLabelSidecarVersion) {
    throw UserError(path.string(),
                    ": has format version ",
                    json["version"].dump(),
                    ", and this program knows version ",
                    kLabelSidecarVersion,
                    "; choose another ",
                    Field{"output_path"},
                    ", or the program version that wrote it.");
  }
  ExportRecord record;
  if (const Json& checksum = json[kSourceModelKey]; checksum.is_string()) {
    record.foam_checksum = checksum.get<std::string>();
  }
  record.frame = json["frame"].dump();
  if (const Json& labels = json["labels"]; labels.is_object()) {
    for (const auto& [id, name] : labels.items()) {
      const auto number = JsonInteger(Json::parse(id, nullptr, false), 0, kLargestId);
      if (number && name.is_string()) {
        record.label_names[static_cast<LabelId>(*number)] = name.get<std::string>();
      }
    }
  }
  AddFiles(json, kNoObject, output_path, &record);
  for (const Json& object : json["objects"]) {
    if (!object.is_object()) continue;
    const auto id = JsonInteger(object.value("id", Json()), 0, kLargestId);
    const Json name = object.value("name", Json());
    if (!id) continue;
    const auto object_id = static_cast<LabelId>(*id);
    if (name.is_string()) record.object_names[object_id] = name.get<std::string>();
    AddFiles(object, object_id, output_path, &record);
  }
  return record;
}

bool IsInFrame(const ExportRecord& record, const ExportTransform& transform) {
  Json there = Json::parse(record.frame), here = Json::parse(ExportTransformJson(transform));
  // It places nothing, and older files do not hold it.
  for (Json* frame : {&there, &here}) {
    if (frame->is_object()) frame->erase("up_tilt_degrees");
  }
  return there == here;
}

void RequireSameFoam(const fs::path& output_path, const std::string& foam_checksum) {
  ReadExportRecord(output_path);
  const fs::path path = output_path / "scene.foam";
  if (!fs::exists(path) || ModelChecksum(path) == foam_checksum) return;
  throw UserError(path.string(),
                  ": is another foam than the one to export, whose files would lie beside it; "
                  "choose another ",
                  Field{"output_path"},
                  ".");
}

void RequireOneFrame(const ExportTransform& transform,
                     const fs::path& output_path,
                     const std::set<ExportFormat>& formats,
                     const std::string& foam_checksum) {
  const std::optional<ExportRecord> record = ReadExportRecord(output_path);
  if (!record || IsInFrame(*record, transform)) return;
  // Those of another foam go.
  if (!record->foam_checksum.empty() && record->foam_checksum != foam_checksum) return;
  for (const ExportRecord::File& file : record->files) {
    if (IsReplaced(file.format, formats)) continue;
    throw UserError((output_path / file.path).string(),
                    ": is in another frame than this export and would stay; choose another ",
                    Field{"output_path"},
                    ", or the ",
                    Field{"transform"},
                    ", ",
                    Field{"level"},
                    ", ",
                    Field{"up_axis"},
                    ", ",
                    Field{"scale"},
                    " and ",
                    Field{"units"},
                    " that "
                    "labels.json there tells of.");
  }
}

void WarnOfOtherExports(const fs::path& output_path) {
  std::optional<ExportRecord> record;
  try {
    record = ReadExportRecord(output_path);
  } catch (const UserError&) {
    return;  // nothing there claims to be an export of ours
  }
  if (!record || record->files.empty() ||
      record->foam_checksum == ModelChecksum(output_path / "scene.foam")) {
    return;
  }
  LOG(WARNING) << (output_path / "labels.json").string()
               << " and the files that it lists are of the foam that was here before; "
                  "mesh_exporter and volume_exporter replace them.";
}

void WriteLabels(const ExportableScene& scene,
                 const fs::path& output_path,
                 const FinishedExport& finished) {
  std::vector<WrittenFile> files = PossibleFiles(scene);
  std::set<std::string> listed;
  for (const WrittenFile& file : finished.files) listed.insert(file.path);
  if (HasEmbeddings(scene)) listed.insert(kEmbeddingsFile);
  if (const std::optional<ExportRecord> record = ReadExportRecord(output_path)) {
    std::map<LabelId, std::string> object_names;
    for (const ObjectInfo& object : scene.objects) object_names[object.id] = object.name;
    std::set<std::string> possible;
    for (const WrittenFile& file : files) possible.insert(file.path);
    const OlderFiles older = SortOlderFiles(
        *record, finished, IsInFrame(*record, scene.transform), possible, listed, object_names);
    if (finished.is_new_foam && record->foam_checksum != finished.foam_checksum) {
      WarnOfReplacedNames(*record, object_names);
    }
    Remove(output_path, older.other_foam, "it is of another foam");
    Remove(output_path,
           older.other_objects,
           "it shows an object or a name that is not there any more");
    Remove(output_path, older.other_frame, "it is in another frame");
    WarnOfUnlisted(output_path, older.unknown_foam);
    listed.insert(older.kept.begin(), older.kept.end());
  }
  std::erase_if(files, [&](const WrittenFile& file) { return listed.count(file.path) == 0; });
  WriteLabelSidecar(output_path / "labels.json", scene, files, finished.foam_checksum);
}

}  // namespace semfoam
