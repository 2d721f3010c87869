// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/shape_labels.h"

#include "foam/edit/class_table.h"
#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/util/error.h"
#include "foam/util/ids.h"

#include <cstdint>
#include <string>
#include <utility>

namespace semfoam {
namespace {

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

}  // namespace

void RequireGranularity(double granularity) {
  if (granularity >= 0 && granularity <= 1) return;
  throw FieldError("granularity", " is ", granularity, "; it must be 0 to 1.");
}

std::vector<SceneSegment> LabelByShape(double granularity,
                                       const std::filesystem::path& foam_path,
                                       Model* model) {
  RequireGranularity(granularity);
  if (model->statistics.contribution.empty() || model->statistics.passed.empty()) {
    throw UserError(foam_path.string(),
                    ": does not say what photos show of its cells; a foam that was trained here "
                    "would be right.");
  }
  SceneSegments found =
      FindSceneSegments(*model, Triangulate(WithGuardSites(model->foam.positions)), granularity);
  if (found.segments.empty()) {
    throw UserError(foam_path.string(),
                    ": shows no surface that could be cut; a longer training would be right.");
  }
  std::vector<ClassIndex> class_of_cell;
  class_of_cell.reserve(found.segment_of_cell.size());
  // kNoSegment is kUnlabelled.
  for (const int32_t segment : found.segment_of_cell) class_of_cell.push_back(ClassIndex{segment});
  SetClasses(LabelsOf(found.segments), class_of_cell, model);
  return std::move(found.segments);
}

}  // namespace semfoam
