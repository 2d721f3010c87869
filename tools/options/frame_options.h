// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/frame_choice.h"
#include "tools/cli/option_manager.h"

#include <string>

namespace semfoam {

// The options of the frame of written files.
struct FrameOptions {
  FrameChoiceOptions choice;
  // File of camera positions; empty: none (ReadReferencePositions).
  std::string ref_images_path;
  // Whether it holds latitudes, longitudes and altitudes.
  bool ref_is_gps = false;
};

// Adds --transform, --ref_images_path, --ref_is_gps, --level, --level_to_zero, --up_axis, --scale,
// --scale_points and --scale_distance.
void AddPlacingOptions(OptionManager* options, FrameOptions* frame);

// Adds these and --units.
void AddFrameOptions(OptionManager* options, FrameOptions* frame);

// Reads the options, and the file of camera positions. A levelled frame has its z axis up unless
// --up_axis is given. Throws UserError as ReadReferencePositions, and FieldError as
// ParseFrameChoice does. Must be called before any work.
FrameChoice ParseFrame(const OptionManager& options, const FrameOptions& frame);

}  // namespace semfoam
