// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/exportable_scene.h"
#include "export/scene/names.h"
#include "export/scene/object_selection.h"
#include "foam/model/model.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/label_names.h"
#include "tools/options/json_option.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

using nlohmann::ordered_json;

std::string Plural(size_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

void PrintModel(const Model& model) {
  const Foam& foam = model.foam;
  std::printf(
      "Foam\n  %s, SH degree %d, %s\n",
      Plural(foam.NumSites(), "site", "sites").c_str(),
      foam.sh_degree,
      foam.HasSemantics() ? Plural(foam.num_classes, "class", "classes").c_str() : "no semantics");
  const Similarity& similarity = model.world_from_normalized;
  std::printf("Frame\n  x_world = %.17g * x + (%.17g, %.17g, %.17g)\n",
              similarity.scale,
              similarity.translation.x(),
              similarity.translation.y(),
              similarity.translation.z());
}

void PrintPhotos(const std::vector<PhotoRecord>& photos) {
  const size_t held_out = std::count_if(
      photos.begin(), photos.end(), [](const PhotoRecord& photo) { return photo.held_out; });
  std::set<std::string> cameras;
  for (const PhotoRecord& photo : photos) {
    cameras.insert(photo.camera_model + " " + std::to_string(photo.width) + "x" +
                   std::to_string(photo.height));
  }
  std::printf("Photos\n  %s, %zu of them held out\n",
              Plural(photos.size(), "photo", "photos").c_str(),
              held_out);
  for (const std::string& camera : cameras) std::printf("  %s\n", camera.c_str());
}

// Returns the number of decimals that resolves a hundredth of an object's size.
int DecimalsFor(const ObjectInfo& object) {
  const double size = object.bounding_box.sizes().maxCoeff();
  return size > 0 ? std::clamp(2 - static_cast<int>(std::floor(std::log10(size))), 0, 9) : 0;
}

// Returns "  (chair, 0.87)", of what is known of the two; empty where nothing is.
std::string ClassText(const LabelFeatures& features) {
  std::string text = OneLine(features.class_name);
  if (features.score) {
    char score[32];
    std::snprintf(score, sizeof(score), "%.3g", *features.score);
    text += (text.empty() ? "score " : ", ") + std::string(score);
  }
  return text.empty() ? "" : "  (" + text + ")";
}

// One row for each object, 130 columns wide for names and numbers of common length.
void PrintObjects(const ExportableScene& scene) {
  std::printf("Objects (lengths of the COLMAP model)\n");
  std::printf("  %5s  %-14s %6s %6s %4s %5s %8s %8s %5s %6s  %-22s  %s\n",
              "id",
              "name",
              "cells",
              "pieces",
              "cav.",
              "genus",
              "volume",
              "area",
              "conf.",
              "photos",
              "centroid",
              "size");
  for (const ObjectInfo& object : scene.objects) {
    const int decimals = DecimalsFor(object);
    const Eigen::Vector3d& at = object.centroid;
    const Eigen::Vector3d size = object.bounding_box.sizes();
    char centroid[128];
    std::snprintf(centroid,
                  sizeof(centroid),
                  "%.*f %.*f %.*f",
                  decimals,
                  at.x(),
                  decimals,
                  at.y(),
                  decimals,
                  at.z());
    std::printf(
        "  %5d  %-14s %6zu %6d %4lld %5lld %8.3g %8.3g %5.3f %6zu  %-22s  %.3g x %.3g x %.3g%s\n",
        Value(object.id),
        OneLine(object.name).c_str(),
        object.cells.size(),
        object.components,
        static_cast<long long>(object.cavities),
        static_cast<long long>(object.genus),
        object.volume,
        object.area,
        object.confidence,
        object.photos.size(),
        centroid,
        size.x(),
        size.y(),
        size.z(),
        ClassText(FeaturesOf(scene, object.id)).c_str());
  }
  for (const LeftOutLabel& label : scene.labels_left_out) {
    std::printf("  %5d  %-14s is left out, a fragment of %s\n",
                Value(label.id),
                OneLine(label.name).c_str(),
                Plural(static_cast<size_t>(label.left_out.cells), "cell", "cells").c_str());
  }
  for (const Label& label : scene.labels_without_cells) {
    std::printf("  %5d  %-14s has no solid cells\n", Value(label.id), OneLine(label.name).c_str());
  }
}

ordered_json ToJson(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

ordered_json ToJson(const Model& model) {
  const Foam& foam = model.foam;
  const Similarity& similarity = model.world_from_normalized;
  ordered_json json = {{"version", 1},
                       {"sites", foam.NumSites()},
                       {"sh_degree", foam.sh_degree},
                       {"classes", foam.num_classes}};
  json["frame"] = {{"scale", similarity.scale}, {"translation", ToJson(similarity.translation)}};
  json["photos"] = ordered_json::array();
  for (const PhotoRecord& photo : model.photos) {
    json["photos"].push_back({{"name", photo.name},
                              {"camera_model", photo.camera_model},
                              {"width", photo.width},
                              {"height", photo.height},
                              {"held_out", photo.held_out}});
  }
  return json;
}

// Lengths, areas and volumes are those of the COLMAP model.
ordered_json ToJson(const ExportableScene& scene) {
  ordered_json json = {{"objects", ordered_json::array()},
                       {"labels_left_out", ordered_json::array()},
                       {"labels_without_cells", ordered_json::array()}};
  for (const ObjectInfo& object : scene.objects) {
    ordered_json entry = {
        {"id", Value(object.id)},
        {"name", object.name},
        {"cells", object.cells.size()},
        {"components", object.components},
        {"cavities", object.cavities},
        {"genus", object.genus},
        {"volume", object.volume},
        {"area", object.area},
        {"confidence", object.confidence},
        {"photos", object.photos.size()},
        {"centroid", ToJson(object.centroid)},
        {"bounding_box", {ToJson(object.bounding_box.min()), ToJson(object.bounding_box.max())}}};
    const LabelFeatures features = FeaturesOf(scene, object.id);
    if (!features.class_name.empty()) entry["class"] = OneLine(features.class_name);
    if (features.score) entry["score"] = *features.score;
    json["objects"].push_back(std::move(entry));
  }
  for (const LeftOutLabel& label : scene.labels_left_out) {
    json["labels_left_out"].push_back(
        {{"id", Value(label.id)}, {"name", label.name}, {"cells", label.left_out.cells}});
  }
  for (const Label& label : scene.labels_without_cells) {
    json["labels_without_cells"].push_back({{"id", Value(label.id)}, {"name", label.name}});
  }
  return json;
}

}  // namespace

void RunFoamAnalyzer(int argc, char** argv) {
  std::string foam_path;
  bool json = false;
  OptionManager options("foam_analyzer",
                        "Says what is in a foam: sites, frame, photos, objects, options.");
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  AddJsonOption(&options, &json);
  if (!options.Parse(argc, argv)) return;

  const Model model = ReadNamedModel(foam_path);
  if (json) {
    ordered_json document = ToJson(model);
    document.update(ToJson(PrepareExport(model, foam_path)));
    document["options"] = model.options;
    PrintJson(document);
    return;
  }
  PrintModel(model);
  PrintPhotos(model.photos);
  PrintObjects(PrepareExport(model, foam_path));
  std::printf("Options of the training\n");
  for (const auto& [name, value] : model.options) {
    std::printf("  %s = %s\n", OneLine(name).c_str(), OneLine(value).c_str());
  }
}

}  // namespace semfoam
