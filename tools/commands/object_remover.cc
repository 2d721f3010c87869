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

void RunObjectRemover(int argc, char** argv) {
  std::string foam_path;
  std::string output_path;
  ObjectSelection selection;
  OptionManager options("object_remover",
                        "Takes one or more objects out of a foam. All else stays as it is: empty "
                        "cells where they ended keep their surroundings from growing into the "
                        "hole. What the photos never showed, behind and under them, is a hole or "
                        "a guess.");
  options.AddDeviceOption();
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  options.AddRequiredOption("output_path", &output_path, "folder for the scene.foam without them");
  AddSelectionOptions(&options, &selection);
  if (!options.Parse(argc, argv)) return;
  RequireValid(selection);

  const OutputLock lock(output_path);
  const Model model = ReadNamedModel(foam_path);
  const std::filesystem::path target = EditedFoamPath(output_path, {foam_path});
  const ChosenObjects chosen = ChooseObjects(model, selection, foam_path, options.device());
  const Model edited = RemoveObjects(
      model, chosen.delaunay, chosen.cell_labels, chosen.is_in_object, chosen.objects);
  WriteModel(target, edited);
  CopyLight(edited, foam_path, target);
  WarnOfOtherExports(output_path);
  const size_t num_gone = model.foam.NumSites() - edited.foam.NumSites();
  LOG(INFO) << "Removed " << Joined(chosen.names) << ": " << chosen.num_cells << " cells, "
            << chosen.num_cells - num_gone << " of which stay as empty guards, in "
            << target.string();
}

}  // namespace semfoam
