// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/io/surface_export.h"
#include "export/io/volume_export.h"
#include "export/scene/exportable_scene.h"
#include "export/scene/frame_choice.h"
#include "export/scene/label_choice.h"
#include "foam/model/model.h"
#include "tools/controllers/export_format.h"
#include "tools/controllers/texture_source.h"
#include "tools/controllers/training_folder.h"
#include "tools/controllers/training_run.h"

#include <filesystem>
#include <functional>
#include <set>
#include <string>

namespace semfoam {

// Options of SegmentScene. The defaults are those of `semfoam automatic_segmenter`.
struct SceneSegmenterOptions {
  TrainingRun run;
  // Created if it does not exist.
  std::filesystem::path output_path;
  CheckpointOptions checkpoints;
  // The command for TrainingFolder.
  std::string resume_command = "the same, with CheckpointOptions::resume";

  // The objects to write files for.
  LabelChoice choice;
  ComponentOptions components;
  VolumeExportOptions volume;
  // Its photos are those of `run`, if textures are wanted.
  SurfaceExportOptions surface;
  // Whether to bake textures (for obj, glb and usda), and their format.
  bool has_textures = true;
  TextureFormat texture_format = TextureFormat::kPng;
  // The frame of the exports.
  FrameChoice frame;
  // The formats to write: vdb, om, ply, obj, glb and usda.
  std::set<ExportFormat> formats = {ExportFormat::kVdb,
                                    ExportFormat::kOm,
                                    ExportFormat::kPly,
                                    ExportFormat::kObj,
                                    ExportFormat::kGlb,
                                    ExportFormat::kUsda};

  // Called, unless empty, when all files are written, before the run counts as finished.
  std::function<void(const Model&, const ExportableScene&)> when_exported;
};

// Trains a foam and writes it, the volume and the surface of every object and labels.json into
// `output_path`: TrainAndWrite, PrepareExport, WriteVolumes, WriteMeshes and WriteLabels, in this
// order. Calls CompleteTrainingRun for `options.run`. Detects errors that would only occur after
// the training before a photo is read, or before the training. Logs its steps. Does nothing if it
// is to resume a finished folder. Throws UserError and Interruption, as these functions do.
void SegmentScene(SceneSegmenterOptions options);

}  // namespace semfoam
