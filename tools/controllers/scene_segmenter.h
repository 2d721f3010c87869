// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "export/scene/export_transform.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/label_choice.h"
#include "tools/controllers/export_format.h"
#include "tools/controllers/training_folder.h"
#include "tools/controllers/training_run.h"

#include <filesystem>
#include <set>
#include <string>

namespace semfoam {

// What `semfoam automatic_segmenter` does, from photos to files. The defaults are the command's.
struct SceneSegmenterOptions {
  TrainingRun run;
  std::filesystem::path output_path;  // made where it does not exist
  CheckpointOptions checkpoints;
  std::string resume_command = "the same, with CheckpointOptions::resume";  // see TrainingFolder

  LabelChoice choice;  // of the objects that get files
  ComponentOptions components;
  VolumeExportOptions volume;
  SurfaceExportOptions surface;
  ExportTransform transform;  // of ParseExportTransform
  // Of vdb, om, ply, obj, glb and usda.
  std::set<ExportFormat> formats = {ExportFormat::kVdb,
                                    ExportFormat::kOm,
                                    ExportFormat::kPly,
                                    ExportFormat::kObj,
                                    ExportFormat::kGlb,
                                    ExportFormat::kUsda};
};

// Trains a foam and writes it, every object's volume and surface and labels.json into
// `output_path`: TrainAndWrite, PrepareExport, WriteVolumes, WriteMeshes and WriteLabels, in this
// order. `options.run` need not be complete (CompleteTrainingRun). What would fail only after the
// training is refused before a photo is read, or before the training. Logs what it does. Does
// nothing where a finished folder is to be resumed. Throws UserError and Interruption, as these do.
void SegmentScene(SceneSegmenterOptions options);

}  // namespace semfoam
