// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/edit/object_insertion.h"
#include "foam/model/model.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/effects_report.h"
#include "tools/controllers/export_choice.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/label_names.h"
#include "tools/options/export_options.h"
#include "tools/options/object_choice.h"
#include "tools/options/object_placement_options.h"
#include "tools/support/output_lock.h"

#include <string>
#include <vector>

#include <glog/logging.h>

namespace semfoam {

void RunObjectInserter(int argc, char** argv) {
  std::string foam_path;
  std::string object_path;
  std::string output_path;
  LabelChoice choice;
  PlacementOptions placement_options;
  OptionManager options("object_inserter",
                        "Puts the objects of one foam into another: where they were in their own "
                        "COLMAP model, or turned, scaled, moved, or stood on a surface. What they "
                        "overlap with goes; what they do not touch stays.");
  options.AddDeviceOption();
  options.AddRequiredOption("foam_path", &foam_path, "the scene to put them into, scene.foam");
  options.AddRequiredOption(
      "object_path", &object_path, "the foam that has them: any, or one by object_extractor");
  options.AddRequiredOption("output_path", &output_path, "folder for the scene.foam with them");
  AddLabelOptions(&options, &choice);
  AddPlacementOptions(&options, &placement_options);
  if (!options.Parse(argc, argv)) return;
  const ParsedPlacement parsed = ParsePlacement(placement_options);

  const OutputLock lock(output_path);
  const Model scene = ReadNamedModel(foam_path);
  const Model source = ReadNamedModel(object_path);
  const std::filesystem::path target = EditedFoamPath(output_path, {foam_path, object_path});
  const ChosenObjects chosen = ChooseObjects(source, choice, object_path);
  const ExtractedObjects objects = ExtractObjects(source, chosen.delaunay, chosen.objects);
  const ViewRenderer renderer(scene.foam, options.device());
  ObjectPlacement placement;
  if (placement_options.align_to.empty()) {
    placement = PlaceAboutMiddle(objects, parsed);
  } else {
    const PhotoPixel pixel = ParsePhotoPixel("align_to", placement_options.align_to);
    placement =
        PlaceOnSurface(objects, parsed, SurfaceAt(scene, renderer, pixel, foam_path), object_path);
  }
  const Insertion insertion =
      InsertObjects(scene, renderer.delaunay(), PlaceObjects(objects, placement, scene));
  WriteModel(target, insertion.model);
  CopyLight(insertion.model, foam_path, target);
  WarnOfOtherExports(output_path);
  std::vector<std::string> names;
  for (size_t k = 0; k < chosen.names.size(); ++k) {
    names.push_back(chosen.names[k]);
    const LabelId id = insertion.labels[k].id;
    if (id != LabelIdOf(source.labels, chosen.objects[k].class_index)) {
      names.back() += " as " + std::to_string(Value(id));
    }
  }
  LOG(INFO) << "Inserted " << Joined(names) << ": " << chosen.num_cells << " cells and "
            << insertion.num_ring_sites << " around them instead of " << insertion.num_removed
            << " of the scene's, in " << target.string();
}

}  // namespace semfoam
