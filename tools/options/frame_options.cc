// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/options/frame_options.h"

#include "plugin/colmap/reference_positions.h"
#include "tools/options/enum_option.h"

namespace semfoam {

void AddPlacingOptions(OptionManager* options, FrameOptions* frame) {
  FrameChoiceOptions& choice = frame->choice;
  options->AddDefaultOption("transform",
                            &choice.transform.transform,
                            "a similarity from the COLMAP frame to that of the files: the 12 or 16 "
                            "numbers of its matrix, row by row");
  options->AddDefaultOption(
      "ref_images_path",
      &frame->ref_images_path,
      "in place of --transform: a text file of measured camera positions, "
      "\"name x y z\" a line, to which the model is turned, scaled and moved");
  options->AddDefaultOption("ref_is_gps",
                            &frame->ref_is_gps,
                            "the positions are latitude, longitude and altitude; the frame is then "
                            "in metres east, north and up of the first");
  options->AddDefaultOption(
      "level",
      &choice.level,
      "then a turn that makes level: cameras = what they show as up becomes "
      "vertical; plane = the largest plane becomes horizontal; or the plane "
      "of a label, by name or id, as floor; name:plane where a label is called "
      "so; none. z is up then, unless --up_axis says otherwise");
  options->AddDefaultOption("level_to_zero",
                            &choice.level_to_zero,
                            "and a shift that brings the plane of --level to height 0");
  AddEnumOption(options,
                "up_axis",
                &choice.transform.up_axis,
                kUpAxisNames,
                "then a turn, by a multiple of 90 degrees, of what is up in the photos "
                "onto this axis; colmap = none, and no --level");
  options->AddDefaultOption("scale", &choice.transform.scale, "then so many times as large");
  options->AddDefaultOption(
      "scale_points",
      &choice.scale_points,
      "in place of --scale: \"x,y,z x,y,z\", two points in the COLMAP model's "
      "frame that are --scale_distance apart in the files");
  options->AddDefaultOption(
      "scale_distance", &choice.scale_distance, "the distance of the --scale_points in the files");
}

void AddFrameOptions(OptionManager* options, FrameOptions* frame) {
  AddPlacingOptions(options, frame);
  AddEnumOption(options,
                "units",
                &frame->choice.transform.units,
                kLengthUnitNames,
                "what one unit of the files is then; changes no number");
}

FrameChoice ParseFrame(const OptionManager& options, const FrameOptions& frame) {
  FrameChoiceOptions choice = frame.choice;
  if (frame.ref_images_path.empty()) {
    options.RequireEffect({"ref_is_gps"}, "without --ref_images_path; give both, or neither");
  } else {
    for (const ImagePosition& at :
         ReadReferencePositions(frame.ref_images_path, frame.ref_is_gps)) {
      choice.references.push_back({at.image, at.position});
    }
  }
  if (choice.level != "none" && !options.IsGiven("up_axis")) {
    choice.transform.up_axis = UpAxis::kZ;
  }
  return ParseFrameChoice(choice);
}

}  // namespace semfoam
