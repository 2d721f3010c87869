// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/report/report_writer.h"

#include "tools/cli/input_protection.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/export_objects.h"
#include "tools/controllers/label_names.h"
#include "tools/evaluation/evaluation.h"
#include "tools/options/pixel_sampling.h"
#include "tools/support/output_lock.h"

#include <filesystem>
#include <string>

namespace semfoam {

void RunReportWriter(int argc, char** argv) {
  namespace fs = std::filesystem;
  std::string foam_path;
  std::string image_path;
  std::string output_path;
  std::string input_path;
  std::string truth_path;
  std::string labels_path;
  ReportOptions report;
  OptionManager options("report_writer",
                        "Writes a report of a foam, one page for any browser: figures, views, "
                        "objects, and the foam itself in 3D.");
  options.AddDeviceOption();
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  options.AddRequiredOption("image_path", &image_path, "folder of the photos");
  options.AddRequiredOption(
      "output_path", &output_path, "folder for report.html, or the file's own path, *.html");
  options.AddDefaultOption(
      "input_path", &input_path, "the COLMAP model, sparse/0, to show its points");
  options.AddDefaultOption("truth_path",
                           &truth_path,
                           "folder of exact masks, <object>/<photo>.png; by default "
                           "segmentation_labels/masks/ beside the photos' folder");
  options.AddDefaultOption(
      "labels_path", &labels_path, "labels.json with names; by default the foam's own");
  options.AddDefaultOption(
      "max_views", &report.max_views, "views to score and to show, spread over those held out");
  options.AddDefaultOption(
      "max_cells", &report.max_cells, "cells to show, those that matter most; 0 = all");
  AddSupersampleOption(&options, &report.supersample);
  if (!options.Parse(argc, argv)) return;
  CheckSupersample(report.supersample);
  RequireValid(report);

  fs::path path = output_path;
  if (path.extension() != ".html" || fs::is_directory(path)) path /= "report.html";
  const OutputLock lock(path.has_parent_path() ? path.parent_path() : fs::path("."));
  CheckNoInputOverwrite({foam_path}, {path});
  RequireOwnReport(path);
  report.foam_path = foam_path;
  report.image_path = image_path;
  report.input_path = input_path;
  report.truth_path = FindTruth(truth_path, image_path);
  report.device = options.device();
  const Model model = ReadNamedModel(foam_path, {}, labels_path);
  const ExportableScene scene = PrepareExport(model, foam_path);
  WriteReport(model, scene, report, path);
}

}  // namespace semfoam
