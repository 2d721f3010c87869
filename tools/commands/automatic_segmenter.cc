// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/object_selection.h"
#include "tools/commands/commands.h"
#include "tools/controllers/export_choice.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/exports.h"
#include "tools/controllers/label_names.h"
#include "tools/controllers/training_folder.h"
#include "tools/controllers/training_run.h"

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <glog/logging.h>

namespace semfoam {

void RunAutomaticSegmenter(int argc, char** argv) {
  std::string workspace_path;
  std::string output_path;
  TrainingRun run;
  CheckpointOptions checkpoints;
  VolumeExportOptions volume;
  SurfaceExportOptions surface;
  LabelChoice choice;
  PieceOptions pieces;
  std::string formats = kAllFormats;
  ExportTransformOptions frame;
  OptionManager options("automatic_segmenter",
                        "Trains a foam on a COLMAP workspace with instance masks and writes every "
                        "object as volume and surface.");
  options.AddRequiredOption(
      "workspace_path", &workspace_path, "folder with images/, sparse/ and object_mask/");
  options.AddRequiredOption("output_path", &output_path, "folder for all that is written");
  options.AddDefaultOption(
      "image_path", &run.image_path, "folder of the photos; by default images/");
  options.AddDefaultOption(
      "input_path", &run.input_path, "the COLMAP model; by default sparse/0/, then sparse/");
  AddTrainingRunOptions(&options, &run);
  AddCheckpointOptions(&options, &checkpoints);
  AddLabelOptions(&options, &choice);
  AddVolumeLabelsName(&options);
  AddVolumeExportOptions(&options, &volume);
  AddMeshExportOptions(&options, &surface);
  AddPieceOptions(&options, &pieces);
  AddFormatsOption(&options, &formats);
  AddFrameOptions(&options, &frame);
  if (!options.Parse(argc, argv)) return;
  RequireValid(volume);
  RequireValid(surface);
  RequireValid(pieces);
  const std::set<std::string> wanted = ParseFormats(formats, kAllFormats);
  RequireEffects(options, volume, choice, wanted);
  const ExportTransform transform = ParseExportTransform(frame);
  CompleteFromWorkspace(workspace_path, &run);
  FinishTrainingRun(options, &run);
  run.when_planned = [&](const ScenePlan& plan) {
    RequirePossible(PlannedExport{choice, volume, transform, wanted, output_path}, plan);
  };
  run.when_labels_are_known = [&](const std::vector<Label>& labels) {
    RequirePossible(choice, labels);
  };

  TrainingFolder folder(output_path, checkpoints, options);
  if (folder.IsFinished()) {
    WarnOfOtherNames(output_path, run.masks.labels_path);
    return;
  }
  folder.RequireReplaceable();
  const std::filesystem::path foam_path = folder.path() / "scene.foam";
  Model model = TrainAndWrite(options, &folder, &run);
  TakeLabelNames(foam_path, {}, {}, &model);
  const ExportableScene scene = PrepareExport(model, foam_path, transform, pieces);
  std::vector<std::string> without_object;
  volume.objects = surface.objects = FilterObjects(scene, choice, &without_object);
  FinishedExport finished{ModelChecksum(foam_path), {}, /*is_new_foam=*/true};
  volume.source_checksum = surface.source_checksum = finished.foam_checksum;
  if (wanted.count("vdb") != 0) finished.files = WriteVolumes(scene, output_path, volume);
  if (wanted != std::set<std::string>{"vdb"}) {
    const std::vector<WrittenFile> meshes = WriteMeshes(scene, output_path, wanted, surface);
    finished.files.insert(finished.files.end(), meshes.begin(), meshes.end());
  }
  WriteLabels(scene, output_path, finished);
  folder.Finish();
  for (const std::string& label : without_object) {
    LOG(WARNING) << "No files for " << label
                 << ", which --labels names: the training made no object "
                 << "of it; labels.json and the lines above say why.";
  }
  const size_t num_objects = SelectObjects(scene, volume.objects).size();
  LOG(INFO) << num_objects << (num_objects == 1 ? " object" : " objects") << ", everything is in "
            << output_path;
}

}  // namespace semfoam
