// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/model.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/effects_report.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/label_names.h"
#include "tools/options/export_options.h"
#include "tools/options/object_choice.h"
#include "tools/support/output_lock.h"

#include <string>

#include <glog/logging.h>

namespace semfoam {

void RunObjectExtractor(int argc, char** argv) {
  std::string foam_path;
  std::string output_path;
  ObjectSelection selection;
  OptionManager options("object_extractor",
                        "Makes a foam of its own of one or more objects: their cells, and the "
                        "cells around them, made empty. It renders and exports as any other, and "
                        "object_inserter puts it into another foam.");
  options.AddDeviceOption();
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  options.AddRequiredOption("output_path", &output_path, "folder for the objects' scene.foam");
  AddSelectionOptions(&options, &selection);
  if (!options.Parse(argc, argv)) return;
  RequireValid(selection);

  const OutputLock lock(output_path);
  const Model model = ReadNamedModel(foam_path);
  const std::filesystem::path target = EditedFoamPath(output_path, {foam_path});
  const ChosenObjects chosen = ChooseObjects(model, selection, foam_path, options.device());
  const ExtractedObjects extracted = ExtractObjects(model, chosen.delaunay, chosen.objects);
  WriteModel(target, extracted.model);
  CopyLight(extracted.model, foam_path, target);
  WarnOfOtherExports(output_path);
  LOG(INFO) << "Extracted " << Joined(chosen.names) << ": " << chosen.num_cells << " cells and "
            << extracted.model.foam.NumSites() - chosen.num_cells << " empty ones around them, in "
            << target.string();
}

}  // namespace semfoam
