// SPDX-License-Identifier: GPL-3.0-or-later
#include "plugin/dataset/survey_places.h"

#include "plugin/colmap/camera_models.h"
#include "plugin/colmap/camera_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Core>
#include <glog/logging.h>

namespace semfoam {
namespace {

// Returns the pixels of a radian in the middle of a photo.
double PixelsPerRadian(const PhotoRecord& photo) {
  const CameraModel* const model = FindCameraModel(photo.camera_model);
  CHECK(model != nullptr) << photo.camera_model;
  const std::vector<double>& params = photo.camera_params;
  switch (model->num_focal_lengths) {
    case 0:
      return params[0] / (2 * std::numbers::pi);  // the width of the sphere
    case 1:
      return params[0];
    default:
      return std::sqrt(params[0] * params[1]);
  }
}

}  // namespace

std::vector<std::vector<SurveyPlace>> SurveyPlacesOf(const ScenePlan& plan) {
  std::vector<Eigen::Vector3d> centers;
  std::vector<double> pixels_per_radian;
  for (const PhotoRecord& photo : plan.photos) {
    centers.push_back(PoseOf(photo).Center());
    pixels_per_radian.push_back(PixelsPerRadian(photo));
  }
  std::vector<std::vector<SurveyPlace>> places(plan.photos.size());
  std::vector<double> resolutions;  // pixels of a unit of length
  for (const Track& track : plan.tracks) {
    resolutions.clear();
    double lowest = std::numeric_limits<double>::infinity();
    for (const PixelObservation& seen : track.observations) {
      const double distance = (track.position - centers[seen.view]).norm();
      resolutions.push_back(pixels_per_radian[seen.view] / distance);
      if (!plan.photos[seen.view].held_out) lowest = std::min(lowest, resolutions.back());
    }
    for (size_t i = 0; i < resolutions.size(); ++i) {
      const PixelObservation& seen = track.observations[i];
      places[seen.view].push_back({seen.pixel, resolutions[i] / lowest});
    }
  }
  return places;
}

}  // namespace semfoam
