// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/commands/commands.h"
#include "tools/controllers/scene_segmenter.h"
#include "tools/options/export_options.h"
#include "tools/options/quality_plot.h"
#include "tools/options/training_run_options.h"

#include <string>

namespace semfoam {

void RunAutomaticSegmenter(int argc, char** argv) {
  std::string workspace_path;
  std::string output_path;
  TrainingRunOptions training;
  SceneSegmenterOptions segmenter;
  std::string formats = kAllFormats;
  ExportTransformOptions frame;
  OptionManager options("automatic_segmenter",
                        "Trains a foam on a COLMAP workspace with instance masks and writes every "
                        "object as volume and surface.");
  options.AddRequiredOption(
      "workspace_path", &workspace_path, "folder with images/, sparse/ and object_mask/");
  options.AddRequiredOption("output_path", &output_path, "folder for all that is written");
  options.AddDefaultOption(
      "image_path", &training.image_path, "folder of the photos; by default images/");
  options.AddDefaultOption(
      "input_path", &training.input_path, "the COLMAP model; by default sparse/0/, then sparse/");
  AddTrainingRunOptions(&options, &training);
  AddCheckpointOptions(&options, &segmenter.checkpoints);
  AddLabelOptions(&options, &segmenter.choice);
  AddVolumeLabelsName(&options);
  AddVolumeExportOptions(&options, &segmenter.volume);
  AddMeshExportOptions(&options, &segmenter.surface);
  AddComponentOptions(&options, &segmenter.components);
  AddFormatsOption(&options, &formats);
  AddFrameOptions(&options, &frame);
  if (!options.Parse(argc, argv)) return;
  RequireValid(segmenter.volume);
  RequireValid(segmenter.surface);
  RequireValid(segmenter.components);
  segmenter.formats = ParseFormats(formats, kAllFormats);
  RequireEffects(options, segmenter.volume, segmenter.choice, segmenter.formats);
  segmenter.transform = ParseExportTransform(frame);
  FinishTrainingRun(options, workspace_path, &training);
  RequireSeedCloudIsKept(training, output_path);

  segmenter.run = training.run;
  segmenter.run.when_written = DrawTrainingPlot;
  segmenter.output_path = output_path;
  segmenter.resume_command = ResumeCommand(options);
  SegmentScene(segmenter);
}

}  // namespace semfoam
