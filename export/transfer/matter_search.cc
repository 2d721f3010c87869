// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/transfer/matter_search.h"

#include "export/volume/volume_extent.h"
#include "foam/util/median.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <unordered_set>
#include <utility>

#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

// The default tolerance, as a share of the diagonal and in radii of cells.
constexpr double kToleranceShare = 0.02;
constexpr double kToleranceRadii = 3;

// x_file = FileFromNormalized(x_normalized), the other way round.
Eigen::Vector3d NormalizedFromFile(const ExportableScene& scene, const Eigen::Vector3d& x) {
  return scene.world_from_normalized.Invert(scene.transform.rotation.transpose() * x);
}

double MedianRadius(const ExportableScene& scene) {
  std::vector<float> radii;
  for (const ObjectInfo& object : scene.objects) {
    for (const uint32_t cell : object.cells) {
      if (scene.photographed[cell] && scene.is_matter[cell]) radii.push_back(scene.radius[cell]);
    }
  }
  return Median(std::move(radii));
}

}  // namespace

MatterSearch::MatterSearch(const ExportableScene& scene, double tolerance)
    : scene_(scene), is_matter_(scene.delaunay.num_cells, 0) {
  CHECK(!scene.objects.empty());
  Refresh(scene.cell_positions, scene.delaunay, &geometry_);
  for (uint32_t i = 0; i < scene.NumSites(); ++i) {
    is_matter_[i] = scene.object_of_cell[i] >= 0 ||
                    (scene.is_matter[i] && scene.photographed[i] && scene.label_id[i] == kNoObject);
  }
  const double scale = scene.world_from_normalized.scale;
  const double radius = MedianRadius(scene);
  resolution_ = scale * radius;
  tolerance_ = tolerance > 0
                   ? tolerance / scale
                   : std::max(kToleranceShare * MakeVolumeFrame(scene, {}).box.diagonal().norm(),
                              kToleranceRadii * radius);
}

double MatterSearch::tolerance() const { return tolerance_ * scene_.world_from_normalized.scale; }

MatterSearch::Found MatterSearch::Find(const Eigen::Vector3d& x_file,
                                       const Eigen::Vector3d& normal,
                                       uint32_t* hint) const {
  if (!x_file.allFinite()) return {};
  const Eigen::Vector3d x = NormalizedFromFile(scene_, x_file);
  const uint32_t cell = NearestCell(geometry_, x, *hint);
  *hint = cell;
  if (is_matter_[cell]) return {cell, 0};
  const double length = normal.norm();
  if (std::isfinite(length) && length > 0) {
    const Eigen::Vector3d direction = scene_.transform.rotation.transpose() * (normal / length);
    const Found forwards = Along(x, direction, cell);
    const Found backwards = Along(x, -direction, cell);
    if (forwards.cell != kNoCell || backwards.cell != kNoCell) {
      if (backwards.cell == kNoCell) return forwards;
      return forwards.cell != kNoCell && forwards.distance < backwards.distance ? forwards
                                                                                : backwards;
    }
  }
  return Around(x, cell);
}

SurfaceLabel MatterSearch::LabelOf(const Found& found) const {
  if (found.cell == kNoCell) return {};
  const int32_t object = scene_.object_of_cell[found.cell];
  const float own = scene_.labels.confidence[found.cell];
  if (object < 0) return {kNoObject, own};
  const ObjectInfo& info = scene_.objects[object];
  const bool is_own_class = scene_.label_id[found.cell] == info.id;
  return {info.id, is_own_class ? own : static_cast<float>(info.confidence)};
}

MatterSearch::Found MatterSearch::Along(const Eigen::Vector3d& x,
                                        const Eigen::Vector3d& direction,
                                        uint32_t cell) const {
  Found found;
  const Eigen::Vector3f origin = x.cast<float>();
  const Eigen::Vector3f along = direction.cast<float>();
  Walk<float>(
      geometry_, origin, along, cell, [&](uint32_t, float, float t_out, uint32_t next, bool) {
        if (t_out > tolerance_) return false;
        if (!is_matter_[next]) return true;
        found = {next, t_out};
        return false;
      });
  return found;
}

MatterSearch::Found MatterSearch::Around(const Eigen::Vector3d& x, uint32_t cell) const {
  // A cell is at least as far from x as the plane between its site and that of the cell of x. The
  // cells that a ball about x meets hang together, and all their planes meet it, too: so a search
  // over neighbours by the distance of planes misses no cell that is nearer than what it finds.
  const Eigen::Vector3d site = scene_.cell_positions[cell].cast<double>();
  const double to_site = (site - x).squaredNorm();
  const auto distance_to_plane = [&](uint32_t other) {
    const Eigen::Vector3d other_site = scene_.cell_positions[other].cast<double>();
    const double apart = (other_site - site).norm();
    return apart > 0 ? ((other_site - x).squaredNorm() - to_site) / (2 * apart) : 0;
  };
  using Met = std::pair<double, uint32_t>;
  std::priority_queue<Met, std::vector<Met>, std::greater<>> next;
  std::unordered_set<uint32_t> met = {cell};
  next.emplace(0, cell);
  while (!next.empty()) {
    const auto [distance, at] = next.top();
    next.pop();
    if (is_matter_[at]) return {at, std::max(0.0, distance)};
    for (const uint32_t other : scene_.delaunay.Neighbors(at)) {
      const double to_other = distance_to_plane(other);
      if (to_other <= tolerance_ && met.insert(other).second) next.emplace(to_other, other);
    }
  }
  return {};
}

double MatterSearch::DistanceToMatter(const Eigen::Vector3d& x_file) const {
  const Eigen::Vector3d x = NormalizedFromFile(scene_, x_file);
  double nearest = std::numeric_limits<double>::infinity();
  for (uint32_t i = 0; i < scene_.NumSites(); ++i) {
    if (!is_matter_[i]) continue;
    nearest = std::min(nearest, (scene_.cell_positions[i].cast<double>() - x).squaredNorm());
  }
  return std::sqrt(nearest) * scene_.world_from_normalized.scale;
}

Eigen::Vector3d MatterSearch::MiddleOfMatter() const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int64_t count = 0;
  for (uint32_t i = 0; i < scene_.NumSites(); ++i) {
    if (!is_matter_[i]) continue;
    sum += scene_.cell_positions[i].cast<double>();
    ++count;
  }
  return scene_.FileFromNormalized(sum / static_cast<double>(count));
}

}  // namespace semfoam
