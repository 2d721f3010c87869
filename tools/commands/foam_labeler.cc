// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/names.h"
#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/model/cell_labels.h"
#include "foam/model/model.h"
#include "foam/util/error.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/effects_report.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/label_names.h"
#include "tools/controllers/mask_labels.h"
#include "tools/controllers/training_run.h"
#include "tools/options/mask_options.h"
#include "tools/options/object_choice.h"
#include "tools/support/output_lock.h"

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

void PrintLabels(const Model& model) {
  const CellLabels cells =
      LabelCells(model.foam, Triangulate(WithGuardSites(model.foam.positions)));
  std::vector<int64_t> solid(model.labels.size(), 0);
  for (size_t i = 0; i < cells.solid.size(); ++i) {
    if (cells.solid[i] != 0) ++solid.at(Value(cells.class_index[i]));
  }
  std::printf("  %5s  %-20s %8s\n", "id", "name", "cells");
  for (size_t k = 0; k < model.labels.size(); ++k) {
    std::printf("  %5d  %-20s %8lld\n",
                Value(model.labels[k].id),
                OneLine(model.labels[k].name).c_str(),
                static_cast<long long>(solid[k]));
  }
}

}  // namespace

void RunFoamLabeler(int argc, char** argv) {
  std::string foam_path;
  std::string output_path;
  std::string workspace_path;
  TrainingRun run;
  std::string image_path;
  std::string input_path;
  MaskOptions masks;
  OptionManager options(
      "foam_labeler",
      "Labels a trained foam by masks of a few of its photos, or of all, in seconds: without "
      "training again. Masks may be clicks on photos, as the page of report_writer (marks.json) or "
      "LabelMe saves them. Writes another foam; shapes and colours stay.");
  options.AddDeviceOption();
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam, with labels or none");
  options.AddRequiredOption("output_path", &output_path, "folder for the labelled scene.foam");
  options.AddDefaultOption("workspace_path",
                           &workspace_path,
                           "folder that holds images/, sparse/ and perhaps object_mask/");
  options.AddDefaultOption("image_path", &image_path, "folder of the photos it was trained on");
  options.AddDefaultOption(
      "input_path", &input_path, "the COLMAP model it was trained on, sparse/0");
  AddMaskPathOptions(&options, &masks);
  AddMaskReadingOptions(&options, &masks);
  if (!options.Parse(argc, argv)) return;
  run.scene.image_path = image_path;
  run.scene.input_path = input_path;
  if (!workspace_path.empty()) {
    RequireWorkspace(workspace_path);
    CompleteFromWorkspace(workspace_path, &run);
  }
  if (run.scene.image_path.empty() || run.scene.input_path.empty()) {
    throw UserError(
        "Failed to parse options - neither '--workspace_path' nor both of '--image_path' and "
        "'--input_path' are given; the photos and the COLMAP model of the training are needed.");
  }

  const OutputLock lock(output_path);
  Model model = ReadNamedModel(foam_path);
  const std::filesystem::path target = EditedFoamPath(output_path, {foam_path});
  TakeTrainingOptions(model, &run.scene);
  run.scene.mask_path = masks.mask_path;
  run.scene.labels_path = masks.labels_path;
  run.scene.label_zero = masks.Zero();
  // Of these masks, not of those that it was trained on.
  run.scene.mask_consistency = masks.Consistency();
  LabelByMasks(foam_path, run.scene, options.device(), output_path, &model);
  PrintLabels(model);
  WriteModel(target, model);
  CopyLight(model, foam_path, target);
  WarnOfOtherExports(output_path);
  LOG(INFO) << "The labelled foam is " << target.string();
}

}  // namespace semfoam
