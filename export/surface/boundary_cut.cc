// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/surface/boundary_cut.h"

#include "export/surface/clean_cells.h"
#include "foam/util/median.h"
#include "foam/util/min_cut.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// What it costs to change sides, as a share of the area of the cell's faces, where the evidence is
// beyond doubt. Found on the objects of `tabletop` (export/README.md).
constexpr double kMatterCost = 1;
// Matter that no photo shows, inside objects.
constexpr double kHiddenMatterCost = 0.5;
constexpr double kClearAirCost = 0.8;
// Thin matter that most of the light passes.
constexpr double kHazeCost = 0.2;
// At most, within kContactLengths of a contact's plane.
constexpr double kContactCost = 0.15;
constexpr double kContactLengths = 3;
// Without any evidence.
constexpr double kLeastCost = 0.05;
// Number of looks that make half of the evidence.
constexpr double kHalfLooks = 20;

// A hollow (IsHollow) leaves the object for as much of the area of its faces.
constexpr double kHollowGain = 0.5;
// It lets this share of the light pass, has at most this density times radius, and at least so many
// times the median radius of the object's cells that photos show.
constexpr double kHollowPassed = 0.95;
constexpr double kHollowDensity = 0.15;
constexpr double kHollowRadii = 1.4;
// Number of looks that make half of its evidence: few photos look into one.
constexpr double kHalfHollowLooks = 10;

constexpr int kSteps = 3;
// Cells of the supporting object are taken within this number of lengths of the plane.
constexpr double kTakenLengths = 4;
// Cells that photos look through are left alone if they are so many times as large as the object's.
constexpr double kMaxRadii = 6;

// Share of its cells that an object keeps.
constexpr double kLeastKept = 0.5;

constexpr uint32_t kNoNode = std::numeric_limits<uint32_t>::max();

class BoundaryCutter {
 public:
  BoundaryCutter(const ExportableScene& scene,
                 const std::vector<ContactPlane>& contacts,
                 const std::vector<uint32_t>& cells,
                 const Eigen::AlignedBox3d& box,
                 bool opens_hollows)
      : scene_(scene),
        contacts_(contacts),
        box_(box),
        opens_hollows_(opens_hollows),
        nodes_(cells),
        is_inside_(scene.delaunay.num_cells, 0),
        node_of_(scene.delaunay.num_cells, kNoNode) {
    for (const uint32_t cell : cells) is_inside_[cell] = 1;
  }

  std::vector<uint32_t> Cut() {
    FindNodes();
    double total_area = 0;
    for (const uint32_t cell : nodes_) total_area += AreaOf(cell);
    // Costs of faces and of changes are at most as much again each.
    unit_ = total_area > 0 ? std::ldexp(1.0, 60) / total_area : 0;
    MinCut cut(nodes_.size());
    for (size_t node = 0; node < nodes_.size(); ++node) AddNode(node, &cut);
    const std::vector<uint8_t> is_source_side = cut.SourceSide();
    std::vector<uint32_t> result;
    for (size_t node = 0; node < nodes_.size(); ++node) {
      if (is_source_side[node]) result.push_back(nodes_[node]);
    }
    std::sort(result.begin(), result.end());
    return result;
  }

 private:
  // The cells that may change sides: the object's and those around it.
  void FindNodes() {
    double radius = 0;
    for (uint32_t node = 0; node < nodes_.size(); ++node) {
      node_of_[nodes_[node]] = node;
      radius += scene_.radius[nodes_[node]];
    }
    max_radius_ = kMaxRadii * radius / static_cast<double>(nodes_.size());
    std::vector<double> shown;
    for (const uint32_t cell : nodes_) {
      if (scene_.photographed[cell]) shown.push_back(scene_.radius[cell]);
    }
    if (opens_hollows_ && !shown.empty()) hollow_radius_ = kHollowRadii * Median(std::move(shown));
    const int32_t self = scene_.object_of_cell[nodes_.front()];
    size_t begin = 0;
    for (int step = 0; step < kSteps; ++step) {
      const size_t end = nodes_.size();
      for (size_t k = begin; k < end; ++k) {
        for (const uint32_t next : scene_.delaunay.Neighbors(nodes_[k])) {
          if (next >= scene_.NumSites() || node_of_[next] != kNoNode || !MayJoin(next, self)) {
            continue;
          }
          node_of_[next] = static_cast<uint32_t>(nodes_.size());
          nodes_.push_back(next);
        }
      }
      begin = end;
    }
  }

  bool MayJoin(uint32_t cell, int32_t self) const {
    if (IsBeyond(cell)) return false;
    const int32_t owner = scene_.object_of_cell[cell];
    if (owner == self) return true;
    if (scene_.crossed[cell]) return owner < 0 && scene_.radius[cell] <= max_radius_;
    return owner < 0 || LengthsToContact(cell) < kTakenLengths;
  }

  // Whether a cell is out of the box or beyond a contact.
  bool IsBeyond(uint32_t cell) const {
    return !box_.contains(scene_.cell_positions[cell].cast<double>()) || LengthsToContact(cell) < 0;
  }

  // The least distance of a site from a contact's plane, in its lengths; negative beyond it.
  double LengthsToContact(uint32_t cell) const {
    double lengths = std::numeric_limits<double>::infinity();
    for (const ContactPlane& contact : contacts_) {
      const double distance =
          contact.plane.signedDistance(scene_.cell_positions[cell].cast<double>());
      lengths = std::min(lengths, -distance / contact.length);
    }
    return lengths;
  }

  double AreaOf(uint32_t cell) const {
    double area = 0;
    for (uint32_t e = scene_.delaunay.offsets[cell]; e < scene_.delaunay.offsets[cell + 1]; ++e) {
      area += scene_.face_areas[e];
    }
    return area;
  }

  void AddNode(size_t node, MinCut* cut) const {
    const uint32_t cell = nodes_[node];
    double to_outside = 0;
    for (uint32_t e = scene_.delaunay.offsets[cell]; e < scene_.delaunay.offsets[cell + 1]; ++e) {
      const uint32_t next = scene_.delaunay.neighbors[e];
      if (node_of_[next] != kNoNode) {
        const int64_t cost = InUnits(scene_.face_areas[e]);
        if (cell < next) cut->AddEdge(node, node_of_[next], cost, cost);
      } else if (!IsBeyond(next)) {
        to_outside += scene_.face_areas[e];
      }
    }
    if (IsHollow(cell)) {
      to_outside += kHollowGain * Evidence(cell, kHalfHollowLooks) * AreaOf(cell);
      cut->AddTerminals(node, 0, InUnits(to_outside));
      return;
    }
    const int64_t to_change = InUnits(CostOfChange(cell) * AreaOf(cell));
    cut->AddTerminals(node,
                      is_inside_[cell] ? to_change : 0,
                      InUnits(to_outside) + (is_inside_[cell] ? 0 : to_change));
  }

  int64_t InUnits(double area) const { return static_cast<int64_t>(area * unit_); }

  // Whether a cell of the object is a hollow: thin, larger than most that photos show, and nearly
  // all light passes it before it has met its surface. Few photos look into a cup or between
  // leaves, and training leaves haze there; before glossy surfaces it leaves it, too, but in small
  // cells.
  bool IsHollow(uint32_t cell) const {
    const double passed = scene_.passed[cell], stopped = scene_.stopped[cell];
    return is_inside_[cell] && passed > kHollowPassed * (passed + stopped) &&
           scene_.density[cell] * scene_.radius[cell] < kHollowDensity &&
           scene_.radius[cell] > hollow_radius_;
  }

  // 0 without looks, towards 1 with many.
  double Evidence(uint32_t cell, double half_looks) const {
    const double looks = scene_.passed[cell] + scene_.stopped[cell];
    return looks / (looks + half_looks);
  }

  double CostOfChange(uint32_t cell) const {
    const double passed = scene_.passed[cell], stopped = scene_.stopped[cell];
    double cost = 0;
    if (is_inside_[cell]) {
      if (scene_.is_matter[cell]) {
        cost = scene_.photographed[cell] ? kMatterCost : kHiddenMatterCost;
      }
    } else if (IsClearAir(scene_, cell)) {
      cost = kClearAirCost;
    } else if (passed > stopped) {
      cost = kHazeCost;
    }
    if (LengthsToContact(cell) < kContactLengths) cost = std::min(cost, kContactCost);
    return kLeastCost + cost * Evidence(cell, kHalfLooks);
  }

  const ExportableScene& scene_;
  const std::vector<ContactPlane>& contacts_;
  const Eigen::AlignedBox3d box_;
  const bool opens_hollows_;
  // The object's cells first.
  std::vector<uint32_t> nodes_;
  std::vector<uint8_t> is_inside_;
  std::vector<uint32_t> node_of_;
  double max_radius_ = 0;
  double hollow_radius_ = std::numeric_limits<double>::infinity();
  double unit_ = 0;
};

}  // namespace

std::vector<uint32_t> CutBoundary(const ExportableScene& scene,
                                  const std::vector<ContactPlane>& contacts,
                                  const std::vector<uint32_t>& cells,
                                  const Eigen::AlignedBox3d& box,
                                  bool opens_hollows) {
  CHECK(std::is_sorted(cells.begin(), cells.end()));
  if (scene.passed.empty() || cells.empty()) return cells;
  std::vector<uint32_t> cut = BoundaryCutter(scene, contacts, cells, box, opens_hollows).Cut();
  std::vector<uint32_t> kept;
  std::set_intersection(
      cut.begin(), cut.end(), cells.begin(), cells.end(), std::back_inserter(kept));
  const bool loses_itself =
      static_cast<double>(kept.size()) < kLeastKept * static_cast<double>(cells.size());
  return loses_itself ? cells : cut;
}

}  // namespace semfoam
