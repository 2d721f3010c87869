// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/names.h"
#include "foam/util/error.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/mask/masked_photos.h"
#include "plugin/mask/point_labels.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/masks/model_masks.h"
#include "tools/masks/point_label_files.h"
#include "tools/options/json_option.h"
#include "tools/options/mask_options.h"
#include "tools/support/output_lock.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr const char* kPointsFile = "points.ply";
constexpr const char* kLabelsFile = "points_labels.json";

// What is written must not take the place of the model that it was made from, nor of a model or
// points that this command did not write; nor may the model lie beside one of the other format,
// which readers would mix up.
void RequireRoomForFiles(const fs::path& output_path,
                         const fs::path& model_folder,
                         ModelFormat format) {
  if (fs::exists(output_path) && fs::equivalent(output_path, model_folder)) {
    throw UserError(output_path.string(),
                    ": is the folder of the model itself, whose colours would be lost; another "
                    "--output_path would be right.");
  }
  const bool is_ours = fs::exists(output_path / kLabelsFile);
  if (const fs::path points = output_path / kPointsFile; fs::exists(points) && !is_ours) {
    throw UserError(points.string(),
                    ": was not written by this program and would be lost; give another "
                    "--output_path.");
  }
  for (const char* stem : {"cameras", "images", "points3D"}) {
    for (const auto& [extension, of] :
         {std::pair(".bin", ModelFormat::kBinary), std::pair(".txt", ModelFormat::kText)}) {
      const fs::path file = output_path / (std::string(stem) + extension);
      if (!fs::exists(file) || (is_ours && of == format)) continue;
      throw UserError(file.string(),
                      ": is of another model, which would be lost or mixed up with this one; an "
                      "empty --output_path would be right.");
    }
  }
}

// Numbers of points, and sums of their confidences.
struct LabelCounts {
  // [labels]
  std::vector<int64_t> points;
  std::vector<double> confidence;
  int64_t unlabelled = 0;
};

LabelCounts Count(const std::vector<PointLabel>& points, size_t num_labels) {
  LabelCounts counts{std::vector<int64_t>(num_labels), std::vector<double>(num_labels), 0};
  for (const PointLabel& point : points) {
    if (point.class_index == kUnlabelled) {
      ++counts.unlabelled;
      continue;
    }
    ++counts.points[Value(point.class_index)];
    counts.confidence[Value(point.class_index)] += point.confidence;
  }
  return counts;
}

ordered_json ToJson(const LabelCounts& counts, const std::vector<Label>& labels) {
  ordered_json json = {{"version", 1}, {"labels", ordered_json::array()}};
  for (size_t k = 0; k < labels.size(); ++k) {
    ordered_json label = {
        {"id", Value(labels[k].id)}, {"name", labels[k].name}, {"points", counts.points[k]}};
    if (counts.points[k] > 0) {
      label["confidence"] = counts.confidence[k] / static_cast<double>(counts.points[k]);
    }
    json["labels"].push_back(std::move(label));
  }
  json["unlabelled_points"] = counts.unlabelled;
  return json;
}

void PrintLabels(const LabelCounts& counts, const std::vector<Label>& labels) {
  std::printf("  %5s  %-20s %9s %10s\n", "id", "name", "points", "confidence");
  for (size_t k = 0; k < labels.size(); ++k) {
    const std::string name =
        labels[k].id == kNoObject ? "(none of them)" : DisplayName(labels[k].id, labels[k].name);
    std::printf("  %5d  %-20s %9lld",
                Value(labels[k].id),
                OneLine(name).c_str(),
                static_cast<long long>(counts.points[k]));
    if (counts.points[k] > 0) {
      std::printf(" %10.3f", counts.confidence[k] / static_cast<double>(counts.points[k]));
    }
    std::printf("\n");
  }
  std::printf(
      "  %5s  %-20s %9lld\n", "", "(no mask tells)", static_cast<long long>(counts.unlabelled));
}

}  // namespace

void RunPointLabeler(int argc, char** argv) {
  std::string workspace_path;
  std::string input_path;
  std::string output_path;
  bool json = false;
  MaskOptions masks;
  OptionManager options(
      "point_labeler",
      "Labels the points of a COLMAP model by a vote of instance masks over their tracks, in "
      "seconds and without training. Writes the model with its points in the colours of their "
      "labels, points.ply with a label and a confidence for each, and points_labels.json.");
  options.AddDefaultOption("workspace_path",
                           &workspace_path,
                           "folder with sparse/ and object_mask/; or give --input_path");
  options.AddDefaultOption("input_path",
                           &input_path,
                           "the COLMAP model; by default sparse/0/, then sparse/ of the workspace");
  options.AddRequiredOption("output_path", &output_path, "folder for what is written");
  AddMaskPathOptions(&options, &masks);
  AddMaskReadingOptions(&options, &masks);
  AddJsonOption(&options, &json);
  if (!options.Parse(argc, argv)) return;
  const MaskedModelPaths paths =
      FindMaskedModel(workspace_path, input_path, masks, /*needs_model=*/true);
  const ModelFormat format = FindModelFormat(paths.model_folder);
  const auto begin = std::chrono::steady_clock::now();
  RequireRoomForFiles(output_path, paths.model_folder, format);
  const OutputLock lock(output_path);

  const Reconstruction model = ReadRegistered(paths.model_folder);
  const MaskedPhotos photos =
      ReadModelMasks(model, paths.mask_folder, masks.Zero(), masks.Consistency()).photos;
  const std::vector<Label> labels =
      NamedLabelsOf(photos, paths.labels_file, options.IsGiven("labels_path"));
  const std::vector<PointLabel> points = LabelPoints(photos);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  LOG(INFO) << points.size() << " points labelled in " << std::lround(1000 * seconds)
            << " ms, reading included";
  const fs::path folder = output_path;
  WriteReconstruction(folder, ColoredByLabel(model, points, labels), format);
  WritePointsPly(folder / kPointsFile, model, points, labels);
  WritePointLabelsJson(folder / kLabelsFile, model, photos, points, labels);
  const LabelCounts counts = Count(points, labels.size());
  if (json) {
    PrintJson(ToJson(counts, labels));
  } else {
    PrintLabels(counts, labels);
  }
}

}  // namespace semfoam
