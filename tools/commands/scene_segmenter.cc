// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/edit/class_table.h"
#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/model/model.h"
#include "foam/segment/scene_segments.h"
#include "foam/util/error.h"
#include "foam/util/ids.h"
#include "tools/cli/option_manager.h"
#include "tools/commands/commands.h"
#include "tools/controllers/effects_report.h"
#include "tools/controllers/export_record.h"
#include "tools/controllers/label_names.h"
#include "tools/options/object_choice.h"
#include "tools/support/output_lock.h"

#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Returns a label for each segment: "plane_1", "plane_2", ..., "thing_1", ..., by size.
std::vector<Label> LabelsOf(const std::vector<SceneSegment>& segments) {
  std::vector<Label> labels;
  int num_planes = 0, num_things = 0;
  for (const SceneSegment& segment : segments) {
    const auto id = static_cast<int32_t>(labels.size()) + 1;
    const std::string name = segment.is_plane ? "plane_" + std::to_string(++num_planes)
                                              : "thing_" + std::to_string(++num_things);
    labels.push_back({LabelId{id}, MaskId{static_cast<uint32_t>(id)}, name});
  }
  return labels;
}

void LogSegments(const std::vector<SceneSegment>& segments, const std::vector<Label>& labels) {
  LOG(INFO) << "     id  name              cells  of what photos show";
  for (size_t i = 0; i < segments.size(); ++i) {
    char line[128];
    std::snprintf(line,
                  sizeof(line),
                  "  %5d  %-14s %8lld  %5.1f %%",
                  Value(labels[i].id),
                  labels[i].name.c_str(),
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
  if (!(granularity >= 0 && granularity <= 1)) {
    throw UserError(
        "Failed to parse options - --granularity ", granularity, ": 0 to 1 would be right.");
  }

  const OutputLock lock(output_path);
  Model model = ReadNamedModel(foam_path);
  const std::filesystem::path target = EditedFoamPath(output_path, {foam_path});
  if (model.statistics.passed.empty() || model.statistics.stopped.empty()) {
    throw UserError(foam_path,
                    ": does not say what photos show of its cells; a foam that was trained here "
                    "would be right.");
  }
  if (model.foam.HasSemantics()) {
    LOG(WARNING) << foam_path << " has labels already; those of the segments replace them";
  }
  const SceneSegments found =
      FindSceneSegments(model, Triangulate(WithGuardSites(model.foam.positions)), granularity);
  if (found.segments.empty()) {
    throw UserError(foam_path,
                    ": shows no surface that could be cut; a longer training would be right.");
  }
  std::vector<Label> labels = LabelsOf(found.segments);
  LogSegments(found.segments, labels);
  std::vector<ClassIndex> class_of_cell;
  for (const int32_t s : found.segment_of_cell) class_of_cell.push_back(ClassIndex{s});
  SetClasses(std::move(labels), class_of_cell, &model);
  WriteModel(target, model);
  CopyLight(model, foam_path, target);
  WarnOfOtherExports(output_path);
  LOG(INFO) << "The labelled foam is " << target.string();
}

}  // namespace semfoam
