// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/scene/level_surface.h"

#include "export/scene/object_selection.h"
#include "foam/util/error.h"
#include "foam/util/median.h"

#include <algorithm>
#include <cstddef>
#include <string>

#include <glog/logging.h>

namespace semfoam {
namespace {

constexpr size_t kFewestSamples = 10;
constexpr double kMostWeight = 4;
constexpr double kToleranceRadii = 2;
constexpr double kToleranceShare = 0.01;

void RequireEnough(size_t count, const std::string& of, const char* what, const char* right) {
  if (count >= kFewestSamples) return;
  throw FieldError("level",
                   " is ",
                   of,
                   ", of which photos show ",
                   count,
                   " ",
                   what,
                   "; a plane needs ",
                   kFewestSamples,
                   " or more: ",
                   right,
                   ", or cameras.");
}

}  // namespace

SurfaceSamples LevelSurface(const ExportableScene& scene, const LevelChoice& level) {
  CHECK(level.by == LevelBy::kPlane || level.by == LevelBy::kLabels);
  LabelFilter filter;
  if (level.by == LevelBy::kLabels) {
    NamingLevel([&] { filter = FilterObjects(scene, {level.labels}); });
  }
  const auto is_inside = [&](uint32_t cell) {
    if (level.by == LevelBy::kPlane) return scene.is_matter[cell] != 0;
    const int32_t object = scene.object_of_cell[cell];
    return object >= 0 && filter.Has(scene.objects[object].id);
  };
  const bool knows_rays = !scene.passed.empty();
  const auto is_open = [&](uint32_t cell) {
    return !scene.is_matter[cell] && scene.object_of_cell[cell] < 0 &&
           (!knows_rays || scene.crossed[cell]);
  };
  SurfaceSamples samples;
  std::vector<float> radii;
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    if (!is_inside(i)) continue;
    const Eigen::Vector3d site = scene.cell_positions[i].cast<double>();
    double area = 0;
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    for (uint32_t k = scene.delaunay.offsets[i]; k < scene.delaunay.offsets[i + 1]; ++k) {
      const uint32_t j = scene.delaunay.neighbors[k];
      if (j >= scene.NumSites() || is_inside(j) || !is_open(j)) continue;
      area += scene.face_areas[k];
      moment += scene.face_areas[k] * (scene.cell_positions[j].cast<double>() - site) / 2;
    }
    if (!(area > 0)) continue;
    samples.points.push_back(scene.colmap_from_normalized.Apply(site + moment / area));
    samples.weights.push_back(area);
    radii.push_back(scene.radius[i]);
  }
  RequireEnough(samples.points.size(),
                level.by == LevelBy::kPlane ? "plane" : "'" + level.labels + "'",
                "cells",
                "a larger thing");
  const double most = kMostWeight * Median(samples.weights);
  for (double& weight : samples.weights) weight = std::min(weight, most);
  samples.tolerance = kToleranceRadii * Median(radii) * scene.colmap_from_normalized.scale;
  return samples;
}

SurfaceSamples LevelSurface(const std::vector<Eigen::Vector3d>& points, const LevelChoice& level) {
  if (level.by == LevelBy::kLabels) {
    throw FieldError("level",
                     " is '",
                     level.labels,
                     "', but without a foam nothing has labels; choose plane or cameras, or give ",
                     Field{"foam_path"},
                     ".");
  }
  SurfaceSamples samples;
  for (const Eigen::Vector3d& x : points) {
    if (x.allFinite()) samples.points.push_back(x);
  }
  RequireEnough(samples.points.size(), "plane", "points", "a model with points");
  samples.weights.assign(samples.points.size(), 1);
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> coordinates;
    for (const Eigen::Vector3d& x : samples.points) coordinates.push_back(x[axis]);
    middle[axis] = Median(coordinates);
  }
  std::vector<double> distances;
  for (const Eigen::Vector3d& x : samples.points) distances.push_back((x - middle).norm());
  samples.tolerance = kToleranceShare * Median(distances);
  if (!(samples.tolerance > 0)) {
    throw FieldError("level",
                     " is plane, but most points of the model are in one place; choose cameras.");
  }
  return samples;
}

}  // namespace semfoam
