// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/export_transform.h"
#include "export/scene/label_choice.h"
#include "export/volume/volume_options.h"
#include "foam/model/model.h"
#include "plugin/dataset/scene_plan.h"
#include "tools/controllers/export_format.h"

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace semfoam {

// What of an export can be refused before a photo is read, so that no training is spent on files
// that cannot be written.

// An export that a training is to end with.
struct PlannedExport {
  // Which objects are to be written.
  LabelChoice choice;
  VolumeExportOptions volume;
  // What ParseExportTransform returned: TurnUpright comes later.
  ExportTransform transform;
  std::set<ExportFormat> formats;
  // The folder to write into.
  std::filesystem::path output_path;
};

// Checks an export against the scene that is planned, no photo of which is read yet. Throws
// UserError where `choice` names what no mask can make a label; where a folder is in the way of a
// file or the other way round; and where voxels certainly do not fit (VoxelsThatCannotFit). Throws
// FieldError where `choice` names objects and there are no masks, and where the photos do not tell
// what is up.
void RequirePossible(const PlannedExport& planned, const ScenePlan& plan);

// Checks the choice of objects against the labels of the decoded masks. Throws UserError where it
// names none of them or is ambiguous.
void RequirePossible(const LabelChoice& choice, const std::vector<Label>& labels);

}  // namespace semfoam
