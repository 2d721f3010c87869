// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/export_transform.h"
#include "foam/edit/model_transform.h"
#include "foam/geometry/sim3.h"
#include "foam/model/model.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/output_file.h"
#include "plugin/colmap/colmap_model.h"
#include "plugin/colmap/model_transform.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/effects_report.h"
#include "tools/controllers/export_frame.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/label_names.h"
#include "tools/masks/model_masks.h"
#include "tools/options/frame_options.h"
#include "tools/options/object_choice.h"
#include "tools/support/output_lock.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

struct AlignerPaths {
  std::string foam;
  std::string input;
  std::string output;

  fs::path Model() const { return fs::path(output) / "sparse" / "0"; }
  // What the command leaves beside the models, by which it knows its own.
  fs::path Frame() const { return fs::path(output) / "frame.json"; }
};

void AddOptions(OptionManager* options, AlignerPaths* paths, FrameOptions* frame) {
  options->AddDefaultOption("foam_path", &paths->foam, "the foam, scene.foam");
  options->AddDefaultOption(
      "input_path", &paths->input, "the COLMAP model, sparse/0; by itself, or with its foam");
  options->AddRequiredOption(
      "output_path",
      &paths->output,
      "folder for scene.foam, sparse/0 and frame.json, which tells the transform");
  AddPlacingOptions(options, frame);
  options->SetFrequentOptions({"foam_path",
                               "input_path",
                               "level",
                               "level_to_zero",
                               "up_axis",
                               "scale_points",
                               "scale_distance",
                               "ref_images_path",
                               "ref_is_gps",
                               "transform"});
}

// Throws UserError where frame.json is another program's.
void RequireOwnFrame(const fs::path& path) {
  if (!fs::exists(path)) return;
  const auto json = nlohmann::json::parse(
      ReadFileBytes(path, "a JSON file"), nullptr, /*allow_exceptions=*/false);
  if (json.is_object() && json.contains("file_from_colmap")) return;
  throw UserError(path.string(),
                  ": was not written by this command and would be lost; choose another ",
                  Field{"output_path"},
                  ".");
}

// Throws UserError where the model's place has files that this command did not write.
void RequireRoom(const AlignerPaths& paths) {
  const fs::path folder = paths.Model();
  if (!fs::exists(folder) || (fs::is_directory(folder) && fs::is_empty(folder))) return;
  std::error_code error;
  if (fs::equivalent(FindModelFolder(paths.input), folder, error) || !fs::exists(paths.Frame())) {
    throw UserError(folder.string(),
                    ": is there already, and not by this command; choose another ",
                    Field{"output_path"},
                    ".");
  }
}

// Throws UserError where the cameras of the same photos stand in different places, by more than a
// refinement of poses moves them.
void RequireSameFrame(const Model& model,
                      const Reconstruction& reconstruction,
                      const AlignerPaths& paths) {
  constexpr double kRefinement = 0.05;
  std::map<std::string, Eigen::Vector3d> centers;
  for (const Image& image : reconstruction.images) {
    centers[image.name] = image.cam_from_world.Center();
  }
  std::vector<double> distances;
  Eigen::AlignedBox3d box;
  for (const PhotoRecord& photo : model.photos) {
    const auto center = centers.find(photo.name);
    if (center == centers.end()) continue;
    const Pose pose{photo.cam_from_world_rotation, photo.cam_from_world_translation};
    box.extend(pose.Center());
    distances.push_back((pose.Center() - center->second).norm());
  }
  std::sort(distances.begin(), distances.end());
  if (distances.empty() ||
      distances[distances.size() / 2] > kRefinement * std::max(box.diagonal().norm(), 1e-9)) {
    throw UserError(paths.input,
                    ": is not the COLMAP model of ",
                    paths.foam,
                    distances.empty() ? ", for they have no photo in common"
                                      : ", for the cameras of their photos are in other places",
                    "; give the one that it was trained on.");
  }
}

// Returns frame.json: the transform, and its inverse, by which --transform undoes it.
std::string FrameJson(const ExportTransform& transform) {
  nlohmann::ordered_json json = nlohmann::ordered_json::parse(ExportTransformJson(transform));
  const Eigen::Matrix3d inverse = transform.rotation.transpose() / transform.scale;
  const Eigen::Vector3d origin = -(inverse * transform.translation);
  std::vector<double> numbers;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) numbers.push_back(inverse(row, column) + 0.0);
    numbers.push_back(origin[row] + 0.0);
  }
  numbers.insert(numbers.end(), {0, 0, 0, 1});
  json["colmap_from_file"] = numbers;
  json.erase("unit");
  json.erase("meters_per_unit");
  return json.dump(1) + "\n";
}

}  // namespace

void RunModelAligner(int argc, char** argv) {
  AlignerPaths paths;
  FrameOptions frame;
  OptionManager options(
      "model_aligner",
      "Writes a foam, its COLMAP model, or both, in another frame: level, with up "
      "on an axis, to scale, or where measured camera positions say. The cameras "
      "see the same as before.");
  AddOptions(&options, &paths, &frame);
  if (!options.Parse(argc, argv)) return;
  if (paths.foam.empty() && paths.input.empty()) {
    throw UserError(
        "Failed to parse options - neither '--foam_path' nor '--input_path' is given; give the "
        "foam, the COLMAP model, or both.");
  }
  const FrameChoice choice = ParseFrame(options, frame);

  const OutputLock lock(paths.output);
  std::optional<Model> model;
  std::optional<Reconstruction> reconstruction;
  fs::path target, input_folder;
  RequireOwnFrame(paths.Frame());
  if (!paths.foam.empty()) {
    model = ReadNamedModel(paths.foam);
    target = EditedFoamPath(paths.output, {paths.foam});
  }
  if (!paths.input.empty()) {
    input_folder = FindModelFolder(paths.input);
    RequireRoom(paths);
    reconstruction = ReadRegistered(input_folder);
  }
  if (model && reconstruction) RequireSameFrame(*model, *reconstruction, paths);
  const ExportTransform transform =
      model ? FindFrame(*model, choice) : FindFrame(*reconstruction, choice);
  const Sim3 target_from_source{transform.scale, transform.rotation, transform.translation};
  if (model) {
    TransformModel(target_from_source, &*model);
    WriteModel(target, *model);
    CopyLight(*model, paths.foam, target);
    WarnOfOtherExports(paths.output);
  }
  WriteTextFile(paths.Frame(), FrameJson(transform));
  if (reconstruction) {
    TransformReconstruction(target_from_source, &*reconstruction);
    WriteReconstruction(paths.Model(), *reconstruction, FindModelFormat(input_folder));
  }
  LOG(INFO) << (model ? target.string() : std::string()) << (model && reconstruction ? " and " : "")
            << (reconstruction ? paths.Model().string() : std::string()) << ": scaled by "
            << transform.scale << "; " << paths.Frame().string() << " tells the transform";
}

}  // namespace semfoam
