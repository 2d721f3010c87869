// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/frame_choice.h"

#include "foam/geometry/similarity_fit.h"
#include "foam/geometry/upward.h"
#include "foam/util/error.h"
#include "foam/util/number_text.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <sstream>
#include <utility>

#include <Eigen/Geometry>

namespace semfoam {
namespace {

constexpr double kMaxScale = 1e9;

bool ScaleInRange(double scale) { return scale >= 1 / kMaxScale && scale <= kMaxScale; }

// Throws when the text is anything but finite numbers apart by spaces or commas.
std::vector<double> ParseNumbers(std::string text, const FieldError& error) {
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream words(text);
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    double number = 0;
    if (!ParseNumber(word, &number) || !std::isfinite(number)) throw error;
    numbers.push_back(number);
  }
  return numbers;
}

LevelChoice ParseLevel(const FrameChoiceOptions& options) {
  LevelChoice level;
  level.to_zero = options.level_to_zero;
  if (const std::optional<LevelBy> by = ParseEnum(kLevelByNames, options.level)) {
    level.by = *by;
  } else {
    level.by = LevelBy::kLabels;
    level.labels = options.level;
  }
  if (options.level.find_first_not_of(' ') == std::string::npos) {
    throw FieldError("level",
                     " is '",
                     options.level,
                     "'; it must be none, cameras, plane, or the label of something flat, such as "
                     "floor or 7.");
  }
  if (level.to_zero && (level.by == LevelBy::kNone || level.by == LevelBy::kCameras)) {
    throw FieldError("level_to_zero",
                     " moves a plane, and ",
                     Field{"level"},
                     " ",
                     options.level,
                     " has none; choose plane or a label, or leave it out.");
  }
  return level;
}

// Returns what scale_points and scale_distance multiply lengths of the COLMAP frame by.
double ScaleOfPoints(const FrameChoiceOptions& options) {
  const FieldError points("scale_points",
                          " is '",
                          options.scale_points,
                          "'; it must be two different points of the COLMAP model's frame, x,y,z "
                          "x,y,z.");
  if (options.scale_points.empty()) {
    throw FieldError("scale_distance",
                     " is ",
                     options.scale_distance,
                     ", but there are no ",
                     Field{"scale_points"},
                     "; give both, or neither.");
  }
  const std::vector<double> numbers = ParseNumbers(options.scale_points, points);
  if (numbers.size() != 6) throw points;
  const double distance = (Eigen::Map<const Eigen::Vector3d>(numbers.data()) -
                           Eigen::Map<const Eigen::Vector3d>(numbers.data() + 3))
                              .norm();
  if (!(distance > 0)) throw points;
  if (!(options.scale_distance > 0)) {
    throw FieldError("scale_distance",
                     " is ",
                     options.scale_distance,
                     "; it must be the distance of the ",
                     Field{"scale_points"},
                     " in units of the files, greater than 0.");
  }
  if (options.transform.scale != 1) {
    throw FieldError(
        "scale_points", " gives the scale, and so does ", Field{"scale"}, "; give one of the two.");
  }
  if (!options.references.empty()) {
    throw FieldError("scale_points",
                     " gives the scale, and so does ",
                     Field{"ref_images_path"},
                     "; give one of the two.");
  }
  const double scale = options.scale_distance / distance;
  if (!ScaleInRange(scale)) {
    throw FieldError("scale_distance",
                     " is ",
                     options.scale_distance,
                     ", of points that are ",
                     distance,
                     " apart in the model; the scale between them must be from 1e-9 to 1e9.");
  }
  return scale;
}

Eigen::Vector3d Apply(const ExportTransform& transform, const Eigen::Vector3d& x) {
  return transform.scale * (transform.rotation * x) + transform.translation;
}

Eigen::Vector3d CenterOf(const PhotoRecord& photo) {
  return -(photo.cam_from_world_rotation.inverse() * photo.cam_from_world_translation);
}

std::optional<CameraUp> UpOfPhotos(const std::vector<PhotoRecord>& photos) {
  std::vector<Eigen::Quaterniond> rotations;
  rotations.reserve(photos.size());
  for (const PhotoRecord& photo : photos) rotations.push_back(photo.cam_from_world_rotation);
  return UpOfCameras(rotations);
}

// The angle of two directions. Not by an arc cosine, which has no digits for small angles.
double AngleDegrees(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

Eigen::Vector3d NearestAxis(const Eigen::Vector3d& direction) {
  int axis;
  direction.cwiseAbs().maxCoeff(&axis);
  return Eigen::Vector3d::Unit(axis) * (direction[axis] > 0 ? 1 : -1);
}

Eigen::Vector3d AxisOf(UpAxis up_axis) {
  return Eigen::Vector3d::Unit(up_axis == UpAxis::kY ? 1 : 2);
}

// Returns the rotation between two axes of the frame, by a multiple of 90 degrees.
Eigen::Matrix3d TurnOfAxis(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  if (from == -to) return Eigen::Vector3d(1, -1, -1).asDiagonal();
  return Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix().array().round().matrix();
}

// Adds the similarity that fits the photos to the references.
void FitReferences(const std::vector<ReferencePosition>& references,
                   const std::vector<PhotoRecord>& photos,
                   CompletedFrame* frame) {
  if (references.empty()) return;
  ExportTransform* transform = &frame->transform;
  std::map<std::string, Eigen::Vector3d> centers;
  for (const PhotoRecord& photo : photos) centers[photo.name] = CenterOf(photo);
  std::vector<const ReferencePosition*> matched;
  std::vector<Eigen::Vector3d> source, target;
  for (const ReferencePosition& reference : references) {
    const auto center = centers.find(reference.photo);
    if (center == centers.end()) continue;
    matched.push_back(&reference);
    source.push_back(center->second);
    target.push_back(reference.position);
  }
  if (matched.size() < 3) {
    throw FieldError("ref_images_path",
                     " has positions of ",
                     matched.size(),
                     " of the model's ",
                     photos.size(),
                     " photos; three or more are needed, by their names in the model",
                     photos.empty() ? "." : ", such as " + photos.front().name + ".");
  }
  const std::optional<SimilarityFit> fit = FitSimilarity(source, target);
  if (!fit) {
    throw FieldError("ref_images_path",
                     " has positions of ",
                     matched.size(),
                     " photos, which lie on one line and do not tell how the model is turned about "
                     "it; positions beside that line are needed.");
  }
  const Sim3& from_colmap = fit->target_from_source;
  if (!ScaleInRange(transform->scale * from_colmap.scale)) {
    throw FieldError("ref_images_path",
                     " would scale the model by ",
                     transform->scale * from_colmap.scale,
                     "; the scale must be from 1e-9 to 1e9.");
  }
  transform->translation = Apply(*transform, from_colmap.translation);
  transform->rotation = transform->rotation * from_colmap.rotation;
  transform->scale *= from_colmap.scale;
  ReferenceReport report;
  report.photos = std::ssize(matched);
  for (size_t i = 0; i < matched.size(); ++i) {
    if (!fit->is_inlier[i]) report.left_out.push_back(matched[i]->photo);
  }
  report.rms = fit->rms;
  report.max = fit->max;
  frame->referenced = std::move(report);
}

// What becomes vertical: a direction, and the point about which the frame is turned, both in the
// COLMAP frame.
struct Vertical {
  Eigen::Vector3d up;
  Eigen::Vector3d point;
};

Vertical VerticalOfCameras(const std::vector<PhotoRecord>& photos,
                           const std::optional<CameraUp>& camera_up,
                           LevelReport* report) {
  if (!camera_up) {
    throw FieldError(
        "level",
        " is cameras, but the photos do not tell what is up; choose plane or the label "
        "of something flat, or give the turn with ",
        Field{"transform"},
        ".");
  }
  report->by_horizon = camera_up->by_horizon;
  report->spread_degrees = camera_up->spread_degrees;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const PhotoRecord& photo : photos) sum += CenterOf(photo);
  return {camera_up->up, sum / static_cast<double>(photos.size())};
}

// Sets rms and share in units of the COLMAP frame.
Vertical VerticalOfPlane(const std::vector<PhotoRecord>& photos,
                         const std::optional<CameraUp>& camera_up,
                         const SurfaceSamples& surface,
                         LevelReport* report) {
  constexpr double kMaxTilt = 45;
  // Below this cosine the cameras' upward direction lies in the plane rather than across.
  constexpr double kAcross = 0.26;
  std::optional<NormalLimit> limit;
  if (report->by == LevelBy::kPlane && camera_up) limit = NormalLimit{camera_up->up, kMaxTilt};
  const std::optional<PlaneFit> plane = FitPlane(surface, limit);
  if (!plane) {
    throw FieldError("level",
                     " is ",
                     report->by == LevelBy::kPlane ? "plane" : "'" + report->labels + "'",
                     ", but the surface has no plane to level by",
                     limit ? " within 45 degrees of what is level in the photos" : "",
                     "; choose cameras, or the label of something flat.");
  }
  report->rms = plane->rms;
  report->share = plane->share;
  report->cameras = std::ssize(photos);
  const auto count_above = [&](const Eigen::Vector3d& up) {
    return std::count_if(photos.begin(), photos.end(), [&](const PhotoRecord& photo) {
      return up.dot(CenterOf(photo) - plane->point) > 0;
    });
  };
  Vertical vertical{plane->normal, plane->point};
  const double cosine = camera_up ? camera_up->up.dot(plane->normal) : 0;
  const bool is_down =
      std::abs(cosine) > kAcross ? cosine < 0 : 2 * count_above(plane->normal) < report->cameras;
  if (is_down) vertical.up = -vertical.up;
  report->cameras_above = count_above(vertical.up);
  return vertical;
}

// Adds the rotation that makes the frame level, and that onto the up axis.
void Level(const LevelChoice& level,
           const std::vector<PhotoRecord>& photos,
           const SurfaceSamples& surface,
           CompletedFrame* frame) {
  ExportTransform* transform = &frame->transform;
  LevelReport report;
  report.by = level.by;
  report.labels = level.labels;
  const std::optional<CameraUp> camera_up = UpOfPhotos(photos);
  const Vertical vertical = report.by == LevelBy::kCameras
                                ? VerticalOfCameras(photos, camera_up, &report)
                                : VerticalOfPlane(photos, camera_up, surface, &report);
  const Eigen::Vector3d up = transform->rotation * vertical.up;
  const Eigen::Vector3d axis = NearestAxis(up);
  report.turned_degrees = AngleDegrees(up, axis);
  const Eigen::Matrix3d turn =
      Eigen::Quaterniond::FromTwoVectors(up, axis).normalized().toRotationMatrix();
  const Eigen::Vector3d point = Apply(*transform, vertical.point);
  transform->rotation = turn * transform->rotation;
  transform->translation = turn * (transform->translation - point) + point;
  if (level.to_zero) transform->translation -= axis.dot(point) * axis;
  const Eigen::Vector3d target = AxisOf(transform->up_axis);
  const Eigen::Matrix3d turn_of_axis = TurnOfAxis(axis, target);
  transform->rotation = turn_of_axis * transform->rotation;
  transform->translation = turn_of_axis * transform->translation;
  report.rms *= transform->scale;
  // Rounding is no height.
  report.height = level.to_zero ? 0 : target.dot(Apply(*transform, vertical.point));
  transform->up_tilt_degrees = camera_up ? AngleDegrees(transform->rotation * camera_up->up, target)
                                         : std::numeric_limits<double>::quiet_NaN();
  frame->leveled = std::move(report);
}

bool IsLeveled(const FrameChoice& choice) {
  return choice.level.by != LevelBy::kNone && choice.transform.up_axis != UpAxis::kColmap;
}

}  // namespace

FrameChoice ParseFrameChoice(const FrameChoiceOptions& options) {
  FrameChoice choice;
  if (!options.references.empty() && !options.transform.transform.empty()) {
    throw FieldError("ref_images_path",
                     " gives the transform, and so does ",
                     Field{"transform"},
                     "; give one of the two.");
  }
  choice.transform = ParseExportTransform(options.transform);
  if (!options.scale_points.empty() || options.scale_distance != 0) {
    const double scale = ScaleOfPoints(options) / choice.transform.scale;
    choice.transform.scale *= scale;
    choice.transform.translation *= scale;
  }
  choice.level = ParseLevel(options);
  choice.references = options.references;
  return choice;
}

bool NeedsSurface(const FrameChoice& choice) {
  return IsLeveled(choice) && choice.level.by != LevelBy::kCameras;
}

CompletedFrame CompleteFrame(const FrameChoice& choice,
                             const std::vector<PhotoRecord>& photos,
                             const SurfaceSamples& surface) {
  CompletedFrame frame{choice.transform, {}, {}};
  FitReferences(choice.references, photos, &frame);
  if (IsLeveled(choice)) {
    Level(choice.level, photos, surface, &frame);
  } else {
    TurnUpright(photos, &frame.transform);
  }
  return frame;
}

CompletedFrame CompleteByPhotos(const FrameChoice& choice, const std::vector<PhotoRecord>& photos) {
  if (!NeedsSurface(choice)) return CompleteFrame(choice, photos, {});
  CompletedFrame frame{choice.transform, {}, {}};
  FitReferences(choice.references, photos, &frame);
  return frame;
}

void NamingLevel(const std::function<void()>& check) {
  try {
    check();
  } catch (const UserError& error) {
    std::string sentence = error.what();
    sentence[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(sentence[0])));
    throw UserError(Field{"level"}, ": ", sentence);
  }
}

}  // namespace semfoam
