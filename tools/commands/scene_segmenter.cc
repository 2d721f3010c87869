// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/model.h"
#include "foam/segment/scene_segments.h"
#include "foam/util/ids.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/effects_report.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/label_names.h"
#include "tools/controllers/shape_labels.h"
#include "tools/options/object_choice.h"
#include "tools/support/output_lock.h"

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

void LogSegments(const std::vector<SceneSegment>& segments, const Model& model) {
  LOG(INFO) << "     id  name              cells  of what photos show";
  for (size_t i = 0; i < segments.size(); ++i) {
    const Label& label = model.labels[i + 1];
    char line[128];
    std::snprintf(line,
                  sizeof(line),
                  "  %5d  %-14s %8lld  %5.1f %%",
                  Value(label.id),
                  label.name.c_str(),
                  static_cast<long long>(segments[i].cells),
                  100 * segments[i].share);
    LOG(INFO) << line;
  }
}

}  // namespace

void RunSceneSegmenter(int argc, char** argv) {
  std::string foam_path;
  std::string output_path;
  double granularity = 0.5;
  OptionManager options(
      "scene_segmenter",
      "Finds the things of a foam that was trained without masks, by the shape of its surfaces: "
      "planes such as table tops, floors and walls, and what stands on them, apart at concave "
      "creases. Writes another foam with labels plane_1, thing_1, ..., for label_editor to name "
      "and "
      "merge, and for all exporters. Experimental.");
  options.AddRequiredOption("foam_path", &foam_path, "the model, scene.foam");
  options.AddRequiredOption("output_path", &output_path, "folder for the labelled scene.foam");
  options.AddDefaultOption("granularity",
                           &granularity,
                           "0 to 1: how finely to cut; higher cuts at gentler creases, and keeps "
                           "smaller parts");
  if (!options.Parse(argc, argv)) return;
  RequireGranularity(granularity);

  const OutputLock lock(output_path);
  Model model = ReadNamedModel(foam_path);
  const std::filesystem::path target = EditedFoamPath(output_path, {foam_path});
  if (model.foam.HasSemantics()) {
    LOG(WARNING) << foam_path << " has labels already; those of the segments replace them";
  }
  const std::vector<SceneSegment> segments = LabelByShape(granularity, foam_path, &model);
  LogSegments(segments, model);
  WriteModel(target, model);
  CopyLight(model, foam_path, target);
  WarnOfOtherExports(output_path);
  LOG(INFO) << "The labelled foam is " << target.string();
}

}  // namespace semfoam
