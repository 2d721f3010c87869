// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/controllers/export_frame.h"

#include "export/scene/level_surface.h"
#include "export/scene/names.h"
#include "plugin/mask/masked_photos.h"

#include <cmath>
#include <iomanip>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <glog/logging.h>

namespace semfoam {
namespace {

// Logs what a turn by multiples of 90 degrees leaves.
void LogTilt(const ExportTransform& transform) {
  constexpr double kLevelDegrees = 5;
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << "up_axis "
       << NameOf(kUpAxisNames, transform.up_axis) << " leaves the photos' mean upward direction "
       << transform.up_tilt_degrees << " degrees off that axis";
  if (transform.up_tilt_degrees < kLevelDegrees) {
    LOG(INFO) << text.str();
  } else {
    LOG(WARNING)
        << text.str()
        << ", because it turns by multiples of 90 degrees; level the model with level or `colmap "
           "model_orientation_aligner`, or give the rotation with transform.";
  }
}

std::string Degrees(double degrees) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(2) << degrees << " degrees";
  return text.str();
}

// Logs how the cameras told what is up.
void LogCameras(const LevelReport& report) {
  if (report.by_horizon) {
    LOG(INFO) << "level cameras turned the model by " << Degrees(report.turned_degrees)
              << "; the cameras' horizontal axes are off level by "
              << Degrees(report.spread_degrees) << " in the median";
  } else {
    LOG(WARNING) << "level cameras turned the model by " << Degrees(report.turned_degrees)
                 << ", onto the mean of the cameras' upward directions, which are off it by "
                 << Degrees(report.spread_degrees)
                 << " in the median: all look the same way, so how far they look down is unknown; "
                    "level plane or a label would tell.";
  }
}

// Logs how well the plane fits, and what the cameras say of it.
void LogPlane(const ExportTransform& transform, const LevelReport& report) {
  constexpr double kFlatShare = 0.4;
  constexpr double kUprightDegrees = 20;
  const bool is_label = report.by == LevelBy::kLabels;
  const std::string name = is_label ? OneLine(report.labels) : "plane";
  const long percent = std::lround(100 * report.share);
  const double tilt = transform.up_tilt_degrees;
  std::ostringstream text;
  text << "level " << name << " turned the model by " << Degrees(report.turned_degrees) << "; "
       << percent << " % of the surface is near the plane, " << std::setprecision(3) << report.rms
       << " off it (rms), at height " << std::setprecision(6) << report.height << ", below "
       << report.cameras_above << " of " << report.cameras << " cameras; ";
  if (std::isfinite(tilt)) {
    text << "the photos' upward direction is " << Degrees(tilt) << " off its normal";
  } else {
    text << "the photos do not tell what is up";
  }
  LOG(INFO) << text.str();
  if (is_label && report.share < kFlatShare) {
    LOG(WARNING) << "Only " << percent << " % of the surface of " << name
                 << " is near a plane; the label of something flat would level better.";
  }
  if (tilt > kUprightDegrees) {
    LOG(WARNING) << "The normal of " << name << " and the photos' upward direction are "
                 << Degrees(tilt) << " apart; is it level?";
  }
}

void LogReferences(const ExportTransform& transform, const ReferenceReport& report) {
  constexpr size_t kMostNames = 5;
  std::ostringstream text;
  text << "Positions of " << report.photos << " photos fit the model, scaled by "
       << std::setprecision(6) << transform.scale << ", to " << std::setprecision(3) << report.rms
       << " (rms), " << report.max << " at the most";
  if (!report.left_out.empty()) {
    text << "; left out: " << report.left_out.size() << " outliers, ";
    for (size_t k = 0; k < report.left_out.size() && k < kMostNames; ++k) {
      text << (k > 0 ? ", " : "") << OneLine(report.left_out[k]);
    }
    if (report.left_out.size() > kMostNames) text << " ...";
  }
  LOG(INFO) << text.str();
}

void LogFrame(const FrameChoice& choice, const CompletedFrame& frame) {
  const ExportTransform& transform = frame.transform;
  if (frame.referenced) LogReferences(transform, *frame.referenced);
  if (frame.leveled) {
    if (frame.leveled->by == LevelBy::kCameras) {
      LogCameras(*frame.leveled);
    } else {
      LogPlane(transform, *frame.leveled);
    }
  } else if (transform.up_axis != UpAxis::kColmap) {
    LogTilt(transform);
  } else if (choice.level.by != LevelBy::kNone) {
    LOG(INFO) << "up_axis colmap undoes level: the frame is not levelled";
  }
}

ExportTransform Complete(const FrameChoice& choice,
                         const std::vector<PhotoRecord>& photos,
                         const SurfaceSamples& surface) {
  const CompletedFrame frame = CompleteFrame(choice, photos, surface);
  LogFrame(choice, frame);
  return frame.transform;
}

}  // namespace

ExportTransform FindFrame(const Model& model,
                          const FrameChoice& choice,
                          const ComponentOptions& components) {
  SurfaceSamples surface;
  if (NeedsSurface(choice)) {
    ExportableSceneOptions options;
    options.components = components;
    surface = LevelSurface(MakeExportableScene(model, options), choice.level);
  }
  return Complete(choice, model.photos, surface);
}

ExportTransform FindFrame(const Reconstruction& reconstruction, const FrameChoice& choice) {
  SurfaceSamples surface;
  if (NeedsSurface(choice)) {
    std::vector<Eigen::Vector3d> points;
    points.reserve(reconstruction.points.size());
    for (const Point3D& point : reconstruction.points) points.push_back(point.position);
    surface = LevelSurface(points, choice.level);
  }
  return Complete(choice, RegisteredPhotos(reconstruction), surface);
}

}  // namespace semfoam
