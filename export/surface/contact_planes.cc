// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/contact_planes.h"

#include "foam/util/median.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include <Eigen/Eigenvalues>
#include <glog/logging.h>

namespace semfoam {
namespace {

using Eigen::Vector3d;
using Plane = Eigen::Hyperplane<double, 3>;

// Number of cells around a contact in which the support is looked at, and the fewest of them that
// touch the object.
constexpr int kStepsAround = 4;
constexpr size_t kFewestContacts = 8;
constexpr size_t kFewestPoints = 30;
// Half of the points must be within this number of lengths of the plane.
constexpr double kFlat = 1;
constexpr int kPlaneFits = 5;
// The points are no line: the least share of their width in their length.
constexpr double kWidth = 0.2;
// Share of the photographed cells that may lie more than kBeyond lengths beyond the plane.
constexpr double kMaxBeyond = 0.03;
constexpr double kBeyond = 2;
// Optical depth at which surfaces lie (smooth_surface.cc).
constexpr double kSurfaceOpticalDepth = 0.07;
constexpr double kSpikeRadii = 3;
// Cells between an object and a plane.
constexpr double kGapLengths = 4;
constexpr double kFillShare = 0.62;
constexpr int kFillRounds = 5;

Vector3d Site(const ExportableScene& scene, uint32_t cell) {
  return scene.cell_positions[cell].cast<double>();
}

// By least squares over the points within three median distances of the plane before.
std::optional<Plane> FitPlane(const std::vector<Vector3d>& points, double length) {
  if (points.size() < kFewestPoints) return std::nullopt;
  Plane plane;
  double limit = std::numeric_limits<double>::infinity();
  for (int fit = 0; fit < kPlaneFits; ++fit) {
    std::vector<Vector3d> near;
    for (const Vector3d& x : points) {
      if (fit == 0 || plane.absDistance(x) <= limit) near.push_back(x);
    }
    Vector3d mean = Vector3d::Zero();
    for (const Vector3d& x : near) mean += x / static_cast<double>(near.size());
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (const Vector3d& x : near) covariance += (x - mean) * (x - mean).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance);
    if (!(axes.eigenvalues()[1] > kWidth * kWidth * axes.eigenvalues()[2])) return std::nullopt;
    plane = Plane(axes.eigenvectors().col(0), mean);
    std::vector<double> distances;
    for (const Vector3d& x : points) distances.push_back(plane.absDistance(x));
    limit = 3 * Median(std::move(distances));
  }
  return limit <= 3 * kFlat * length ? std::optional(plane) : std::nullopt;
}

// Adds the cells of the same object within kStepsAround steps.
void AddAround(const ExportableScene& scene, int32_t object, std::vector<uint32_t>* cells) {
  std::vector<uint32_t> last = *cells;
  for (int step = 0; step < kStepsAround; ++step) {
    std::vector<uint32_t> next;
    for (const uint32_t cell : last) {
      for (const uint32_t j : scene.delaunay.Neighbors(cell)) {
        if (j < scene.NumSites() && scene.object_of_cell[j] == object &&
            !std::binary_search(cells->begin(), cells->end(), j)) {
          next.push_back(j);
        }
      }
    }
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    const auto middle = cells->insert(cells->end(), next.begin(), next.end());
    std::inplace_merge(cells->begin(), middle, cells->end());
    last = std::move(next);
  }
}

// The plane of what photos show of these cells of the support, its normal out of the object.
std::optional<ContactPlane> FitContact(const ExportableScene& scene,
                                       const ObjectInfo& object,
                                       const std::vector<uint32_t>& support) {
  std::vector<Vector3d> points;
  std::vector<double> lengths, depths;
  for (const uint32_t k : support) {
    if (!scene.photographed[k]) continue;
    for (const uint32_t air : scene.delaunay.Neighbors(k)) {
      if (air >= scene.NumSites() || scene.object_of_cell[air] >= 0 || !scene.crossed[air])
        continue;
      const Vector3d edge = Site(scene, air) - Site(scene, k);
      const double share = std::min(0.5, kSpikeRadii * scene.radius[k] / edge.norm());
      points.push_back(Site(scene, k) + share * edge);
      lengths.push_back(scene.radius[k]);
      depths.push_back(std::min<double>(kSurfaceOpticalDepth / scene.density[k], scene.radius[k]));
    }
  }
  if (points.empty()) return std::nullopt;
  const double length = Median(std::move(lengths));
  const std::optional<Plane> plane = FitPlane(points, length);
  if (!plane) return std::nullopt;
  ContactPlane contact{*plane, length};
  double side = 0;
  for (const uint32_t cell : object.cells) side += contact.plane.signedDistance(Site(scene, cell));
  if (side > 0) contact.plane.coeffs() *= -1;
  // To where the support's surface lies, along the normal.
  contact.plane.offset() -= Median(std::move(depths));
  int64_t beyond = 0, shown = 0;
  for (const uint32_t cell : object.cells) {
    if (!scene.photographed[cell]) continue;
    ++shown;
    beyond += contact.plane.signedDistance(Site(scene, cell)) > kBeyond * length;
  }
  if (static_cast<double>(beyond) > kMaxBeyond * static_cast<double>(shown)) return std::nullopt;
  return contact;
}

bool IsBeyond(const std::vector<ContactPlane>& contacts, const Vector3d& x) {
  return std::any_of(contacts.begin(), contacts.end(), [&](const ContactPlane& contact) {
    return contact.plane.signedDistance(x) > 0;
  });
}

}  // namespace

std::vector<ContactPlane> ContactPlanes(const ExportableScene& scene, const ObjectInfo& object) {
  if (object.cells.empty()) return {};
  const int32_t self = scene.object_of_cell[object.cells.front()];
  std::map<int32_t, std::vector<uint32_t>> touched;
  for (const uint32_t i : object.cells) {
    for (const uint32_t j : scene.delaunay.Neighbors(i)) {
      if (j >= scene.NumSites()) continue;
      const int32_t other = scene.object_of_cell[j];
      if (other >= 0 && other != self) touched[other].push_back(j);
    }
  }
  std::vector<ContactPlane> contacts;
  for (auto& [other, cells] : touched) {
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    if (cells.size() < kFewestContacts) continue;
    AddAround(scene, other, &cells);
    if (const auto contact = FitContact(scene, object, cells)) contacts.push_back(*contact);
  }
  return contacts;
}

std::vector<uint32_t> CellsUpToContacts(const ExportableScene& scene,
                                        const std::vector<ContactPlane>& contacts,
                                        const std::vector<uint32_t>& cells) {
  CHECK(std::is_sorted(cells.begin(), cells.end()));
  if (contacts.empty()) return cells;
  std::vector<uint8_t> is_inside(scene.delaunay.num_cells, 0);
  std::vector<uint32_t> within;
  for (const uint32_t cell : cells) {
    if (IsBeyond(contacts, Site(scene, cell))) continue;
    is_inside[cell] = 1;
    within.push_back(cell);
  }
  const auto is_in_gap = [&](const Vector3d& x) {
    return std::any_of(contacts.begin(), contacts.end(), [&](const ContactPlane& contact) {
      return contact.plane.signedDistance(x) > -kGapLengths * contact.length;
    });
  };
  for (int round = 0; round < kFillRounds; ++round) {
    std::vector<uint32_t> candidates;
    for (const uint32_t cell : within) {
      for (const uint32_t j : scene.delaunay.Neighbors(cell)) {
        if (j >= scene.NumSites() || is_inside[j] || scene.object_of_cell[j] >= 0 ||
            scene.crossed[j] || !is_in_gap(Site(scene, j)) || IsBeyond(contacts, Site(scene, j))) {
          continue;
        }
        candidates.push_back(j);
      }
    }
    std::sort(candidates.begin(), candidates.end());
    candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
    for (const uint32_t cell : candidates) {
      double in = 0, all = 0;
      for (const uint32_t next : scene.delaunay.Neighbors(cell)) {
        const double weight = 1 / (Site(scene, next) - Site(scene, cell)).norm();
        all += weight;
        if (is_inside[next] || IsBeyond(contacts, Site(scene, next))) in += weight;
      }
      if (in <= kFillShare * all) continue;
      is_inside[cell] = 1;
      within.push_back(cell);
    }
  }
  std::sort(within.begin(), within.end());
  return within;
}

}  // namespace semfoam
