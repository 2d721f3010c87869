// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/commands/commands.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/scene_segmenter.h"
#include "tools/options/export_options.h"
#include "tools/options/frame_options.h"
#include "tools/options/quality_plot.h"
#include "tools/options/training_run_options.h"
#include "tools/report/report_writer.h"
#include "tools/support/value_text.h"

#include <cerrno>
#include <filesystem>
#include <string>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Returns the command line that finds the things of the foam in a folder.
std::string SegmenterCommand(const std::filesystem::path& folder) {
  return ShellQuoted(program_invocation_name) + " scene_segmenter --foam_path " +
         ShellQuoted((folder / "scene.foam").string()) + " --output_path " +
         ShellQuoted((folder / "segments").string());
}

}  // namespace

void RunAutomaticSegmenter(int argc, char** argv) {
  std::string workspace_path;
  std::string output_path;
  TrainingRunOptions training;
  SceneSegmenterOptions segmenter;
  std::string formats = kAllFormats;
  FrameOptions frame;
  TextureChoice texture;
  bool writes_report = true;
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
  AddTextureOptions(&options, &texture, &segmenter.surface);
  AddComponentOptions(&options, &segmenter.components);
  AddFormatsOption(&options, &formats);
  AddFrameOptions(&options, &frame);
  options.AddDefaultOption("report",
                           &writes_report,
                           "also report.html, the foam and its figures in one page for a browser");
  options.SetFrequentOptions({"quality",
                              "FoamTraining.time_budget",
                              "test_every",
                              "mask_path",
                              "labels",
                              "formats",
                              "texture",
                              "level",
                              "up_axis",
                              "resume",
                              "overwrite",
                              "progress",
                              "num_threads"});
  if (!options.Parse(argc, argv)) return;
  RequireValid(segmenter.volume);
  RequireValid(segmenter.surface);
  RequireValid(segmenter.components);
  segmenter.formats = ParseFormats(formats, kAllFormats);
  RequireEffects(options, segmenter.volume, segmenter.choice, segmenter.formats);
  segmenter.frame = ParseFrame(options, frame);
  FinishTrainingRun(options, workspace_path, &training);
  RequireSeedCloudIsKept(training, output_path);

  segmenter.run = training.run;
  segmenter.has_textures = texture.is_wanted;
  segmenter.texture_format = texture.format;
  segmenter.run.when_written = DrawTrainingPlot;
  segmenter.output_path = output_path;
  segmenter.resume_command = ResumeCommand(options);
  const std::filesystem::path report_path = segmenter.output_path / "report.html";
  if (writes_report) RequireOwnReport(report_path);
  bool has_no_labels = false;
  segmenter.when_exported = [&](const Model& model, const ExportableScene& scene) {
    has_no_labels = IsWhole(model);
    if (writes_report) {
      ReportOptions report;
      report.foam_path = segmenter.output_path / "scene.foam";
      report.image_path = training.run.scene.image_path;
      report.input_path = training.run.scene.input_path;
      report.device = training.run.device;
      WriteReport(model, scene, report, report_path);
    } else {
      RemoveReport(report_path);
    }
  };
  SegmentScene(segmenter);
  if (has_no_labels) {
    LOG(INFO) << "Objects can be had without masks: click on them in the report (N), save "
                 "marks.json, and label the foam by it with foam_labeler; or have planes and "
                 "things found by their shape: "
              << SegmenterCommand(segmenter.output_path);
  }
}

}  // namespace semfoam
