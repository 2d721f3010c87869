// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/label_sidecar.h"

#include "export/io/npy_writer.h"
#include "export/scene/names.h"
#include "export/scene/object_components.h"
#include "export/scene/object_selection.h"
#include "foam/util/output_file.h"

#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

// Keeps the order of insertion, so that the file reads like its schema.
using Json = nlohmann::ordered_json;

Json LabelTable(const std::vector<Label>& labels) {
  Json table = {{"version", kLabelSidecarVersion}, {"labels", Json::object()}};
  Json source_ids = Json::object();
  for (const Label& label : labels) {
    if (label.id == kNoObject) continue;
    const std::string id = std::to_string(Value(label.id));
    table["labels"][id] = DisplayName(label.id, label.name);
    if (Value(label.source_id) != static_cast<uint32_t>(Value(label.id))) {
      source_ids[id] = Value(label.source_id);
    }
  }
  if (!source_ids.empty()) table["source_ids"] = source_ids;
  return table;
}

// Returns JSON as text. Bytes of a name that are not UTF-8 are replaced by U+FFFD, without an
// exception.
std::string Text(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

// {format: path}.
Json FilesOf(LabelId object_id, const std::vector<WrittenFile>& files) {
  Json paths = Json::object();
  for (const WrittenFile& file : files) {
    if (file.object_id == object_id) paths[file.format] = file.path;
  }
  return paths;
}

Json Triple(const Eigen::Vector3d& x) { return Json::array({x.x(), x.y(), x.z()}); }

Json LeftOut(const LeftOutComponents& left_out) {
  Json json = {
      {"pieces", left_out.components}, {"cells", left_out.cells}, {"volume", left_out.volume}};
  if (left_out.components > 0) {
    json["largest"] = {{"cells", left_out.largest_cells},
                       {"volume", left_out.largest_volume},
                       {"center", Triple(left_out.largest_center)}};
  }
  return json;
}

// Returns the fragments together; empty where there are none.
Json Leftovers(const std::vector<LeftOutLabel>& labels) {
  Json ids = Json::array();
  int64_t cells = 0;
  double volume = 0;
  for (const LeftOutLabel& label : labels) {
    if (!label.is_fragment) continue;
    ids.push_back(Value(label.id));
    cells += label.left_out.cells;
    volume += label.left_out.volume;
  }
  if (ids.empty()) return Json::object();
  return {{"ids", ids},
          {"cells", cells},
          {"volume", volume},
          {"below_share_of_cells", kFragmentShare},
          {"below_share_of_confidence", kFragmentConfidence}};
}

// {name: pixels}, most first.
Json Photos(const ObjectInfo& object) {
  Json photos = Json::object();
  for (const PhotoObservation& observation : object.photos)
    photos[observation.photo] = observation.pixels;
  return photos;
}

void AddFeatures(const LabelFeatures& features, Json* entry, NpyRows* embeddings) {
  if (!features.class_name.empty()) (*entry)["class"] = OneLine(features.class_name);
  if (features.score) (*entry)["score"] = *features.score;
  if (features.embedding.empty()) return;
  (*entry)["embedding"] = {{"file", kEmbeddingsFile}, {"row", embeddings->rows}};
  embeddings->Add(features.embedding);
}

}  // namespace

bool HasEmbeddings(const ExportableScene& scene) {
  return std::any_of(scene.objects.begin(), scene.objects.end(), [&](const ObjectInfo& object) {
    return !FeaturesOf(scene, object.id).embedding.empty();
  });
}

std::string LabelTableJson(const std::vector<Label>& labels) {
  return Text(LabelTable(labels), -1);
}

void WriteLabelSidecar(const std::filesystem::path& path,
                       const ExportableScene& scene,
                       const std::vector<WrittenFile>& files,
                       const std::string& source_checksum) {
  Json sidecar = LabelTable(scene.label_table);
  if (!source_checksum.empty()) sidecar[kSourceModelKey] = source_checksum;
  sidecar["frame"] = Json::parse(ExportTransformJson(scene.transform));
  sidecar["files"] = FilesOf(kNoObject, files);
  Json objects = Json::array();
  NpyRows embeddings;
  for (const ObjectInfo& object : scene.objects) {
    Json entry = {
        {"id", Value(object.id)},
        {"name", object.name},
        {"color", object.color},
        {"cells", object.cells.size()},
        {"pieces", object.components},
        {"cavities", object.cavities},
        {"genus", object.genus},
        {"volume", object.volume},
        {"area", object.area},
        {"centroid", Triple(object.centroid)},
        {"bounding_box",
         Json::array({Triple(object.bounding_box.min()), Triple(object.bounding_box.max())})},
        {"confidence", object.confidence},
        {"left_out", LeftOut(object.left_out)},
        {"photos", Photos(object)},
        {"files", FilesOf(object.id, files)}};
    AddFeatures(FeaturesOf(scene, object.id), &entry, &embeddings);
    objects.push_back(std::move(entry));
  }
  if (embeddings.rows > 0) WriteNpy(path.parent_path() / kEmbeddingsFile, embeddings);
  sidecar["objects"] = objects;
  Json left_out = Json::array();
  for (const LeftOutLabel& label : scene.labels_left_out) {
    left_out.push_back({{"id", Value(label.id)},
                        {"name", label.name},
                        {"reason", label.reason},
                        {"left_out", LeftOut(label.left_out)}});
  }
  if (!left_out.empty()) sidecar["labels_left_out"] = left_out;
  const Json leftovers = Leftovers(scene.labels_left_out);
  if (!leftovers.empty()) sidecar["leftovers"] = leftovers;
  WriteTextFile(path, Text(sidecar, 2) + "\n");
}

}  // namespace semfoam
