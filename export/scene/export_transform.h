// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "foam/geometry/similarity.h"
#include "foam/model/model.h"

#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The axis of the files that points upwards.
enum class UpAxis {
  // The same as in the model.
  kColmap,
  kY,
  kZ,
};
inline constexpr EnumName<UpAxis> kUpAxisNames[] = {
    {UpAxis::kColmap, "colmap"}, {UpAxis::kY, "y"}, {UpAxis::kZ, "z"}};

// The unit of length of the files.
enum class LengthUnit { kUnknown, kMillimeter, kCentimeter, kMeter, kKilometer, kInch, kFoot };
inline constexpr EnumName<LengthUnit> kLengthUnitNames[] = {{LengthUnit::kUnknown, "unknown"},
                                                            {LengthUnit::kMillimeter, "mm"},
                                                            {LengthUnit::kCentimeter, "cm"},
                                                            {LengthUnit::kMeter, "m"},
                                                            {LengthUnit::kKilometer, "km"},
                                                            {LengthUnit::kInch, "inch"},
                                                            {LengthUnit::kFoot, "foot"}};

// The transform from the COLMAP frame to the frame of exported files, x_file = scale * rotation *
// x_colmap + translation, and the unit of the files. By default files are in the COLMAP frame.
// Every format applies the same transform, and records it (ExportTransformJson).
struct ExportTransform {
  double scale = 1;                                        // > 0
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // orthonormal, determinant 1
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();   // in units of the files
  UpAxis up_axis = UpAxis::kColmap;
  LengthUnit unit = LengthUnit::kUnknown;
  // Angle in degrees that remains between the photos' mean upward direction and the up axis of the
  // files after a rotation by multiples of 90 degrees; 0 for kColmap.
  double up_tilt_degrees = 0;

  bool IsTurned() const { return rotation != Eigen::Matrix3d::Identity(); }
  // Returns whether the files are in the COLMAP frame exactly; the unit changes no number.
  bool IsIdentity() const {
    return scale == 1 && !IsTurned() && translation == Eigen::Vector3d::Zero();
  }
  // Returns the metres in one unit of the files; 1 if the unit is unknown.
  double MetersPerUnit() const;

  // Returns the transform without its rotation, combined with `colmap_from_normalized`: x_file =
  // rotation * Unturned(...).Apply(x_normalized). Lengths, densities and lattices are the same with
  // and without the rotation.
  Similarity Unturned(const Similarity& colmap_from_normalized) const;
};

// Options of the transform. Applied from the inside out: x_file = scale * up(transform(x_colmap)).
struct ExportTransformOptions {
  // 12 or 16 numbers, row by row, separated by spaces or commas: the 3x4 or 4x4 matrix of a
  // similarity (rotation, uniform scale, translation); empty: none.
  std::string transform;
  // kY or kZ: rotate the upward direction onto that axis. The upward direction is the axis of the
  // frame, after `transform`, that is nearest to the mean of the photos' upward directions, so that
  // the rotation is by a multiple of 90 degrees and exact: COLMAP's own frames (y down) and
  // levelled ones (z up) both become upright. kColmap: no rotation.
  UpAxis up_axis = UpAxis::kColmap;
  // Scale after that rotation, 1e-9..1e9.
  double scale = 1;
  // Unit of the files, after `scale`; changes no number.
  LengthUnit units = LengthUnit::kUnknown;
};

// Returns the transform without the rotation of `up_axis`, which needs the photos. Throws
// FieldError when an option is out of range.
ExportTransform ParseExportTransform(const ExportTransformOptions& options);

// Adds the rotation of `transform->up_axis`, and sets up_tilt_degrees. Throws FieldError when the
// photos do not determine an upward direction: there are none, or their upward directions cancel
// out (a camera that looks straight down).
void TurnUpright(const std::vector<PhotoRecord>& photos, ExportTransform* transform);

// Returns the description of the frame in files, {"file_from_colmap":[16 numbers, row by
// row],"up_axis":"colmap","unit":"unknown", "meters_per_unit":1.0}; with an up axis also
// "up_tilt_degrees", to a hundredth. Numbers parse to the same doubles.
std::string ExportTransformJson(const ExportTransform& transform);

}  // namespace semfoam
