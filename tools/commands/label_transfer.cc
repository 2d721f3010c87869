// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/label_transfer.h"

#include "export/scene/export_transform.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/names.h"
#include "foam/util/elapsed_time.h"
#include "foam/util/error.h"
#include "foam/util/input_file.h"
#include "foam/util/json_file.h"
#include "tools/cli/input_protection.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/label_names.h"
#include "tools/options/export_options.h"
#include "tools/support/output_lock.h"
#include "tools/support/progress.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <string>

#include <glog/logging.h>
#include <nlohmann/json.hpp>

namespace semfoam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSidecar = "labels.json";

// Throws UserError where the folder holds a labels.json, or a file of the name of the input, that
// an earlier run of this command has not written.
void RequireRoomForFiles(const fs::path& output_path, const fs::path& file) {
  const fs::path sidecar = output_path / kSidecar;
  std::string ours;
  if (fs::exists(sidecar)) {
    const nlohmann::json json = ReadJsonFile(sidecar);
    const auto transfer = json.is_object() ? json.find("transfer") : json.end();
    if (transfer == json.end() || !transfer->is_object()) {
      throw UserError(sidecar.string(),
                      ": was not written by label_transfer and would be lost; give another "
                      "--output_path.");
    }
    if (const auto name = transfer->find("file"); name != transfer->end() && name->is_string()) {
      ours = name->get<std::string>();
    }
  }
  if (const fs::path target = output_path / file; fs::exists(target) && file.string() != ours) {
    throw UserError(target.string(),
                    ": was not written by label_transfer and would be lost; give another "
                    "--output_path.");
  }
}

void PrintLabels(const TransferredLabels& transferred) {
  const bool is_mesh = transferred.faces > 0;
  std::printf("  %5s  %-20s %10s", "id", "name", is_mesh ? "vertices" : "points");
  if (is_mesh) std::printf(" %10s %7s", "faces", "area");
  std::printf(" %10s\n", "confidence");
  for (const TransferredLabel& label : transferred.labels) {
    const bool is_object = label.id != kNoObject;
    std::printf("  %5s  %-20s %10lld",
                is_object ? std::to_string(Value(label.id)).c_str() : "",
                is_object ? OneLine(label.name).c_str() : "(no label)",
                static_cast<long long>(label.vertices));
    if (is_mesh) {
      const double share = transferred.area > 0 ? 100 * label.area / transferred.area : 0;
      std::printf(" %10lld %5.1f %%", static_cast<long long>(label.faces), share);
    }
    std::printf(" %10.3f\n", label.confidence);
  }
}

}  // namespace

void RunLabelTransfer(int argc, char** argv) {
  std::string foam_path;
  std::string input_path;
  std::string output_path;
  std::string labels_path;
  LabelTransferOptions transfer;
  ExportTransformOptions frame;
  OptionManager options(
      "label_transfer",
      "Labels a mesh or a point cloud that another program made of the same photos: each vertex, "
      "face or point gets the label and the confidence of the foam's matter nearest to it. All "
      "else "
      "in the file stays as it is, byte for byte.");
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  options.AddRequiredOption(
      "input_path",
      &input_path,
      "the mesh or point cloud (.ply), as fused.ply or meshed-poisson.ply of COLMAP");
  options.AddRequiredOption("output_path",
                            &output_path,
                            "folder for the labelled file, which keeps its name, and labels.json");
  AddLabelNamesOption(&options, &labels_path);
  options.AddDefaultOption("tolerance",
                           &transfer.tolerance,
                           "matter farther away than this, in the file's unit, is another thing's; "
                           "0 = a fiftieth of the scene's diagonal, or 3 radii of cells");
  options.AddDefaultOption("smoothness",
                           &transfer.smoothness,
                           "meshes: spots of a radius up to about twice this length, in the file's "
                           "unit, are taken for noise; 0 = none, -1 = twice the radius of a cell");
  AddFrameOptions(&options, &frame);
  if (!options.Parse(argc, argv)) return;
  transfer.RequireValid();
  ExportTransform transform = ParseExportTransform(frame);
  const fs::path input = input_path;
  RequireRegularFile(input, "a mesh or a point cloud");
  const fs::path output = fs::path(output_path) / input.filename();
  CheckNoInputOverwrite({input, foam_path}, {output, fs::path(output_path) / kSidecar});
  const OutputLock lock(output_path);
  RequireRoomForFiles(output_path, input.filename());

  const Model model = ReadNamedModel(foam_path, {}, labels_path);
  TurnUpright(model.photos, &transform);
  ExportableSceneOptions scene_options;
  scene_options.transform = transform;
  const ExportableScene scene = MakeExportableScene(model, scene_options);
  RequireObjects(scene, foam_path);

  const auto begin = std::chrono::steady_clock::now();
  TransferredLabels transferred;
  {
    ProgressLine line;
    transferred =
        TransferLabels(scene, input, output, transfer, [&](const std::string& what, double done) {
          const std::string text = what + ", " + std::to_string(std::lround(100 * done)) + " %";
          line.Show({what, done, SecondsSince(begin), text});
        });
    line.Clear();
  }
  WriteTransferSidecar(fs::path(output_path) / kSidecar,
                       scene,
                       transferred,
                       input.filename().string(),
                       ModelChecksum(foam_path));
  LOG(INFO) << output.string() << ": " << transferred.vertices
            << (transferred.faces > 0 ? " vertices" : " points")
            << (transferred.faces > 0
                    ? " and " + std::to_string(transferred.faces) + " faces labelled in "
                    : " labelled in ")
            << FormatDuration(SecondsSince(begin));
  if (transferred.far > 0) {
    LOG(INFO) << 100.0 * static_cast<double>(transferred.far) /
                     static_cast<double>(transferred.looked_at)
              << " % of the vertices are farther than " << transferred.tolerance
              << " from all matter of the foam and have no label of their own";
  }
  PrintLabels(transferred);
}

}  // namespace semfoam
