// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/scene/enum_names.h"
#include "export/scene/export_transform.h"
#include "foam/geometry/plane_fit.h"
#include "foam/model/model.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace semfoam {

// The frame of files where it depends on the photos or on a surface: level, with up on an axis, to
// scale, where photos were measured to be.

// What becomes horizontal in the files, or vertical.
enum class LevelBy {
  // Nothing: the frame is not levelled.
  kNone,
  // The upward direction of the cameras (UpOfCameras) becomes vertical.
  kCameras,
  // The largest plane becomes horizontal; of planes within 45 degrees of level, if the cameras tell
  // what is up.
  kPlane,
  // The plane of the surface of labels becomes horizontal.
  kLabels
};
// Those that are keywords.
inline constexpr EnumName<LevelBy> kLevelByNames[] = {
    {LevelBy::kNone, "none"}, {LevelBy::kCameras, "cameras"}, {LevelBy::kPlane, "plane"}};

// A choice of what to level by.
struct LevelChoice {
  LevelBy by = LevelBy::kNone;
  // For kLabels, as LabelChoice::labels has them.
  std::string labels;
  // For kPlane and kLabels: whether to move the plane to height 0.
  bool to_zero = false;
};

// How a frame was levelled.
struct LevelReport {
  LevelBy by = LevelBy::kNone;
  std::string labels;
  // Angle by which the model was turned to be level.
  double turned_degrees = 0;

  // For kCameras, see CameraUp.
  bool by_horizon = false;
  double spread_degrees = 0;

  // For a plane. Root mean square distance of the samples near it, in units of the files; their
  // share of all samples of the surface, by area; the height at which the plane lies in the files.
  double rms = 0;
  double share = 0;
  double height = 0;
  // Number of cameras above the plane, and of all.
  int64_t cameras_above = 0;
  int64_t cameras = 0;
};

// Where a photo was taken, in a frame of reference such as metres east, north and up of a place.
struct ReferencePosition {
  // PhotoRecord::name.
  std::string photo;
  Eigen::Vector3d position;
};

// How the positions of photos were fitted to reference positions.
struct ReferenceReport {
  // Number of photos with reference positions, and of these left out as outliers.
  int64_t photos = 0;
  std::vector<std::string> left_out;
  // SimilarityFit, without those left out, in units of the reference frame.
  double rms = 0;
  double max = 0;
};

// Options of a frame. Applied from the inside out: x_file = scale * up(level(transform(x_colmap))),
// where the fit to `references` takes the place of `transform`.
struct FrameChoiceOptions {
  // transform, up_axis, scale and units. In a levelled frame up is the axis that it was levelled
  // to. With UpAxis::kColmap nothing is levelled.
  ExportTransformOptions transform;
  // Positions of photos in a frame of reference, three or more of them; empty: none. The similarity
  // that fits them best (FitSimilarity) comes in place of `transform`.
  std::vector<ReferencePosition> references;
  // "none", "cameras", "plane" (LevelBy), or labels as LabelChoice::labels has them; a label of
  // such a name as "name:plane". The upward direction is rotated onto the nearest axis of the frame
  // by the smallest angle, about the middle of the plane or the cameras.
  std::string level = "none";
  // LevelChoice::to_zero.
  bool level_to_zero = false;
  // Two points of the COLMAP frame, six numbers separated by spaces or commas, and their distance
  // in units of the files, > 0: the scale, in place of `scale`. Empty and 0: none.
  std::string scale_points;
  double scale_distance = 0;
};

// A choice of a frame; by default COLMAP's.
struct FrameChoice {
  // What does not depend on photos or a surface, with the name of the up axis (TurnUpright).
  ExportTransform transform;
  LevelChoice level;
  std::vector<ReferencePosition> references;
};

// A frame, and how well it fits what it was chosen by.
struct CompletedFrame {
  // up_tilt_degrees is that of TurnUpright; in a levelled frame the angle between the photos'
  // upward direction by UpOfCameras and the up axis, NaN where they do not tell what is up.
  ExportTransform transform;
  // Nothing: not levelled; without references.
  std::optional<LevelReport> leveled;
  std::optional<ReferenceReport> referenced;
};

// Throws FieldError when an option is out of range, or contradicts another one.
FrameChoice ParseFrameChoice(const FrameChoiceOptions& options);

// Returns whether CompleteFrame needs a surface to level by.
bool NeedsSurface(const FrameChoice& choice);

// Adds what needs the photos: the fit to the references, the levelling, and the rotation of the up
// axis. `surface` is that to level by (LevelSurface), in the COLMAP frame; it is used if
// NeedsSurface. Throws FieldError where less than three photos have a reference position or all lie
// on a line, where the photos do not determine an upward direction that is needed, and where the
// surface has no plane.
CompletedFrame CompleteFrame(const FrameChoice& choice,
                             const std::vector<PhotoRecord>& photos,
                             const SurfaceSamples& surface);

// Returns the frame with what CompleteFrame adds, but for the levelling by a surface and what
// follows it, for checks before there is a surface. Throws what CompleteFrame would throw because
// of the photos.
CompletedFrame CompleteByPhotos(const FrameChoice& choice, const std::vector<PhotoRecord>& photos);

// Calls `check`, which looks up the labels of LevelChoice; what it throws then names the field.
void NamingLevel(const std::function<void()>& check);

}  // namespace semfoam
