// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/frame_choice.h"
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

// Checks an export before any photo is read, so that no training time is wasted on files that
// cannot be written.

// An export that is planned to follow a training.
struct PlannedExport {
  // The objects to write.
  LabelChoice choice;
  VolumeExportOptions volume;
  // The frame of the files.
  FrameChoice frame;
  std::set<ExportFormat> formats;
  // The folder to write into.
  std::filesystem::path output_path;
};

// Checks an export against the plan of the scene. Throws UserError where `choice`, or the levelling
// of `frame`, names labels that no mask can have; where a folder exists at the path of a file
// or the reverse; and where voxels certainly do not fit (VoxelsThatCannotFit). Throws FieldError
// where these name objects and there are no masks, and where the photos do not determine an upward
// direction (CompleteByPhotos).
void RequirePossible(const PlannedExport& planned, const ScenePlan& plan);

// Checks the choice of objects, and that of what `frame` is levelled by, against the labels of
// the decoded masks. Throws UserError where one names none of them or is ambiguous.
void RequirePossible(const LabelChoice& choice,
                     const FrameChoice& frame,
                     const std::vector<Label>& labels);

}  // namespace semfoam
