// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/exportable_scene.h"
#include "foam/model.h"
#include "tools/commands.h"
#include "tools/option_manager.h"

#include <algorithm>
#include <cstdio>
#include <set>
#include <string>

namespace semfoam {
namespace {

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

void PrintObjects(const ExportableScene& scene) {
  std::printf("Objects (lengths of the COLMAP model)\n");
  std::printf("  %5s  %-20s %8s %12s %10s  %s\n",
              "id",
              "name",
              "cells",
              "volume",
              "confidence",
              "bounding box");
  for (const ObjectInfo& object : scene.objects) {
    const Eigen::Vector3d& low = object.bounding_box.min();
    const Eigen::Vector3d& high = object.bounding_box.max();
    std::printf("  %5d  %-20s %8zu %12.6g %10.3f  (%.6g, %.6g, %.6g) to (%.6g, %.6g, %.6g)\n",
                object.id,
                object.name.c_str(),
                object.cells.size(),
                object.volume,
                object.confidence,
                low.x(),
                low.y(),
                low.z(),
                high.x(),
                high.y(),
                high.z());
  }
  for (const Label& label : scene.labels_without_cells) {
    std::printf("  %5d  %-20s has no solid cells\n", label.id, label.name.c_str());
  }
}

}  // namespace

void RunFoamAnalyzer(int argc, char** argv) {
  std::string foam_path;
  OptionManager options("foam_analyzer",
                        "Says what is in a foam: sites, frame, photos, objects, options.");
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  if (!options.Parse(argc, argv)) return;

  const Model model = ReadModel(foam_path);
  PrintModel(model);
  PrintPhotos(model.photos);
  PrintObjects(MakeExportableScene(model));
  std::printf("Options of the training\n");
  for (const auto& [name, value] : model.options) {
    std::printf("  %s = %s\n", name.c_str(), value.c_str());
  }
}

}  // namespace semfoam
