// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/export_transform.h"
#include "export/scene/label_choice.h"
#include "export/volume/volume_options.h"
#include "foam/model/model.h"
#include "plugin/dataset/scene_plan.h"

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace semfoam {

// Which objects a command is to write or to act on, and what of an export can be refused before a
// photo is read, so that no training is spent on files that cannot be written.

// An export that a training is to end with.
struct PlannedExport {
  LabelChoice choice;
  VolumeExportOptions volume;
  ExportTransform transform;  // of ParseExportTransform
  std::set<std::string> formats;
  std::filesystem::path output_path;
};

// With the scene that is planned, no photo of which is read yet: throws UserError where `choice`
// names what no mask can make a label, or there are no masks; where the photos do not tell what is
// up; where a folder is in the way of a file or the other way round; and where voxels certainly do
// not fit (VoxelsThatCannotFit).
void RequirePossible(const PlannedExport& planned, const ScenePlan& plan);

// With the labels of the decoded masks: throws UserError where `choice` names none of them or is
// ambiguous.
void RequirePossible(const LabelChoice& choice, const std::vector<Label>& labels);

}  // namespace semfoam
