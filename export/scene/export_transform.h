// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "foam/geometry/similarity.h"
#include "foam/model/model.h"

#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The axis of the files that points up.
enum class UpAxis {
  kColmap,  // whichever it is in the model
  kY,
  kZ,
};
inline constexpr EnumName<UpAxis> kUpAxisNames[] = {
    {UpAxis::kColmap, "colmap"}, {UpAxis::kY, "y"}, {UpAxis::kZ, "z"}};

// What one unit of the files is.
enum class LengthUnit { kUnknown, kMillimeter, kCentimeter, kMeter, kKilometer, kInch, kFoot };
inline constexpr EnumName<LengthUnit> kLengthUnitNames[] = {{LengthUnit::kUnknown, "unknown"},
                                                            {LengthUnit::kMillimeter, "mm"},
                                                            {LengthUnit::kCentimeter, "cm"},
                                                            {LengthUnit::kMeter, "m"},
                                                            {LengthUnit::kKilometer, "km"},
                                                            {LengthUnit::kInch, "inch"},
                                                            {LengthUnit::kFoot, "foot"}};

// Where exported files put what stands at x in the COLMAP frame: x_file = scale * rotation *
// x_colmap + translation, and what a unit of theirs is. By default they are in the COLMAP frame
// itself. Every format takes the same transform, and records it (ExportTransformJson).
struct ExportTransform {
  double scale = 1;                                        // > 0
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // orthonormal, determinant 1
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();   // in units of the files
  UpAxis up_axis = UpAxis::kColmap;
  LengthUnit unit = LengthUnit::kUnknown;
  // Angle in degrees between the photos' mean upward direction and the up axis of the files, which
  // a turn by multiples of 90 degrees leaves; 0 for kColmap.
  double up_tilt_degrees = 0;

  bool IsTurned() const { return rotation != Eigen::Matrix3d::Identity(); }
  // Exactly the COLMAP frame; the unit changes no number.
  bool IsIdentity() const {
    return scale == 1 && !IsTurned() && translation == Eigen::Vector3d::Zero();
  }
  // Metres in a unit of the files; 1 where the unit is unknown.
  double MetersPerUnit() const;

  // The transform without its turn, after `colmap_from_normalized`: x_file = rotation *
  // Unturned(...).Apply(x_normalized). Lengths, densities and lattices are right in it already.
  Similarity Unturned(const Similarity& colmap_from_normalized) const;
};

// What a user may ask for. Applied from the inside out: x_file = scale * up(transform(x_colmap)).
struct ExportTransformOptions {
  // 12 or 16 numbers, row by row, apart by spaces or commas: the 3x4 or 4x4 matrix of a similarity
  // (rotation, uniform scale, translation); empty: none.
  std::string transform;
  // kY or kZ: turn what is up onto that axis. Up is the axis of the frame, after `transform`,
  // that lies nearest to the mean of the photos' upward directions, so that the turn is by a
  // multiple of 90 degrees and exact: COLMAP's own frames (y down) and levelled ones (z up) both
  // come out upright. kColmap: no turn.
  UpAxis up_axis = UpAxis::kColmap;
  double scale = 1;  // 1e-9..1e9
  // What a unit of the files is, after `scale`; changes no number.
  LengthUnit units = LengthUnit::kUnknown;
};

// All of it but the turn of `up_axis`, which needs the photos. Throws FieldError when an
// option is out of range.
ExportTransform ParseExportTransform(const ExportTransformOptions& options);

// Adds the turn of `transform->up_axis`, and says what it leaves (up_tilt_degrees). Throws
// FieldError when the photos do not tell what is up: there are none, or their upward directions
// cancel out (a camera that looks straight down).
void TurnUpright(const std::vector<PhotoRecord>& photos, ExportTransform* transform);

// {"file_from_colmap":[16 numbers, row by row],"up_axis":"colmap","unit":"unknown",
// "meters_per_unit":1.0}: what files say of their frame; with an up axis also "up_tilt_degrees", to
// a hundredth. Numbers read back as the same doubles.
std::string ExportTransformJson(const ExportTransform& transform);

}  // namespace semfoam
