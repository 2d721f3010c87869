// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/blocks/block_scene.h"

#include "export/scene/scene_cells.h"
#include "foam/geometry/delaunay.h"
#include "foam/geometry/guard_sites.h"
#include "foam/geometry/site_tree.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Most sites that one sphere adds at a time. Few of those inside of a large sphere remain inside of
// the smaller ones that they leave.
constexpr size_t kMostOfSphere = 4;

// A ball that contains the ball around the corners of a tetrahedron, and what rounding may hide.
struct Sphere {
  Eigen::Vector3d center;
  double reach = 0;
};

Sphere CircumscribedSphere(const std::array<Eigen::Vector3d, 4>& corners) {
  // As VoronoiVertices, but the centre stays where it is, however far away.
  const Eigen::Vector3d b = corners[1] - corners[0];
  const Eigen::Vector3d c = corners[2] - corners[0];
  const Eigen::Vector3d d = corners[3] - corners[0];
  const Eigen::Vector3d cd = c.cross(d);
  const double six_volume = b.dot(cd);
  const Eigen::Vector3d numerator =
      b.squaredNorm() * cd + c.squaredNorm() * d.cross(b) + d.squaredNorm() * b.cross(c);
  Eigen::Vector3d to_center = numerator / (2 * six_volume);
  // The relative error of the volume, and so of the centre.
  constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
  const double error = kRounding * (1 + b.norm() * c.norm() * d.norm() / std::abs(six_volume));
  constexpr double kFlat = 1e8;  // far beyond the guards a sphere is a plane
  if (!to_center.allFinite() || to_center.norm() > kFlat) {
    const double length = numerator.norm();
    to_center = length > 0 ? Eigen::Vector3d(numerator * (kFlat / length))
                           : Eigen::Vector3d(kFlat * Eigen::Vector3d::UnitX());
    if (six_volume < 0) to_center = -to_center;
  }
  return {corners[0] + to_center, to_center.norm() * (1 + std::min(error, 1.0))};
}

// Returns the spheres of the tetrahedra around the first `num_own` cells that reach out of `known`.
std::vector<Sphere> SpheresBeyond(const std::vector<Eigen::Vector3f>& cell_positions,
                                  uint32_t num_own,
                                  const Eigen::AlignedBox3d& known) {
  const Delaunay delaunay = Triangulate(cell_positions);
  std::vector<Sphere> spheres;
  for (const std::array<uint32_t, 4>& tet : delaunay.tets) {
    if (*std::min_element(tet.begin(), tet.end()) >= num_own) continue;
    std::array<Eigen::Vector3d, 4> corners;
    for (int k = 0; k < 4; ++k) corners[k] = cell_positions[tet[k]].cast<double>();
    const Sphere sphere = CircumscribedSphere(corners);
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(sphere.reach);
    if (known.contains(Eigen::AlignedBox3d(sphere.center - reach, sphere.center + reach))) continue;
    spheres.push_back(sphere);
  }
  return spheres;
}

bool Meets(const Sphere& sphere, const Eigen::AlignedBox3d& box) {
  return !box.isEmpty() &&
         box.squaredExteriorDistance(sphere.center) <= sphere.reach * sphere.reach;
}

// Returns the sites of `tree` in the spheres that meet `box`, the nearest ones of each, ascending.
std::vector<uint32_t> SitesInSpheres(const std::vector<Sphere>& spheres,
                                     const Eigen::AlignedBox3d& box,
                                     const SiteTree& tree) {
  std::vector<std::vector<uint32_t>> of_sphere(spheres.size());
  ParallelForBlocks(std::ssize(spheres), 64, [&](int64_t begin, int64_t end) {
    for (int64_t k = begin; k < end; ++k) {
      if (!Meets(spheres[k], box)) continue;
      of_sphere[k] = tree.Nearest(spheres[k].center, spheres[k].reach, kMostOfSphere);
    }
  });
  std::vector<uint32_t> sites;
  for (const std::vector<uint32_t>& some : of_sphere) {
    sites.insert(sites.end(), some.begin(), some.end());
  }
  std::sort(sites.begin(), sites.end());
  sites.erase(std::unique(sites.begin(), sites.end()), sites.end());
  return sites;
}

// Appends the rows of these sites.
template <typename Vector>
void AppendRows(const Vector& from, size_t stride, const std::vector<uint32_t>& sites, Vector* to) {
  for (const uint32_t site : sites) {
    const auto begin = from.begin() + static_cast<std::ptrdiff_t>(site * stride);
    to->insert(to->end(), begin, begin + static_cast<std::ptrdiff_t>(stride));
  }
}

}  // namespace

BlockScenes::BlockScenes(const FoamBlocks& blocks, const ExportableSceneOptions& options)
    : blocks_(blocks), options_(options), outlines_(blocks.num_blocks) {
  uint64_t num_sites = 0;
  for (size_t b = 0; b < outlines_.size(); ++b) {
    Outline& outline = outlines_[b];
    const std::vector<Eigen::Vector3f> positions = blocks.read_positions(b);
    outline.first_id = static_cast<uint32_t>(num_sites);
    outline.num_sites = static_cast<uint32_t>(positions.size());
    for (const Eigen::Vector3f& position : positions) outline.box.extend(position.cast<double>());
    num_sites += positions.size();
    CHECK_LT(num_sites + kNumGuardSites, kNoCell);
  }
  num_sites_ = static_cast<uint32_t>(num_sites);
}

std::vector<uint32_t> BlockScenes::PlacesIn(size_t block, const std::vector<uint32_t>& ids) const {
  const uint32_t first = outlines_[block].first_id;
  const auto begin = std::lower_bound(ids.begin(), ids.end(), first);
  const auto end = std::lower_bound(begin, ids.end(), first + outlines_[block].num_sites);
  std::vector<uint32_t> places;
  for (auto id = begin; id != end; ++id) places.push_back(*id - first);
  return places;
}

// A cell is determined by the tetrahedra around its site, and these are in the triangulation of all
// sites exactly if no other site lies in their spheres. So the sites that do are added, until there
// are none. Those on a sphere are added too: among cospherical sites CGAL's symbolic perturbation,
// which compares coordinates alone, then decides as it does in the whole foam.
void BlockScenes::FindSitesAround(size_t block) {
  Outline& own = outlines_[block];
  own.is_known = true;
  if (own.num_sites == 0) return;
  const Eigen::Vector3d halo = Eigen::Vector3d::Constant(blocks_.halo);
  const Eigen::AlignedBox3d known(own.box.min() - halo, own.box.max() + halo);
  std::vector<Eigen::Vector3f> positions = blocks_.read_positions(block);
  const auto add = [&](size_t other,
                       const std::vector<Eigen::Vector3f>& others,
                       const std::vector<uint32_t>& places) {
    for (const uint32_t place : places) {
      own.around.push_back(outlines_[other].first_id + place);
      positions.push_back(others[place]);
    }
  };
  for (size_t c = 0; c < outlines_.size(); ++c) {
    if (c == block || !known.intersects(outlines_[c].box)) continue;
    const std::vector<Eigen::Vector3f> others = blocks_.read_positions(c);
    std::vector<uint32_t> places;
    for (uint32_t k = 0; k < others.size(); ++k) {
      if (known.contains(others[k].cast<double>())) places.push_back(k);
    }
    add(c, others, places);
  }
  for (bool is_complete = false; !is_complete;) {
    is_complete = true;
    const std::vector<Sphere> spheres =
        SpheresBeyond(WithGuardSites(positions), own.num_sites, known);
    std::vector<uint32_t> taken = own.around;
    std::sort(taken.begin(), taken.end());
    for (size_t c = 0; c < outlines_.size(); ++c) {
      const Eigen::AlignedBox3d& box = outlines_[c].box;
      if (c == block || std::none_of(spheres.begin(), spheres.end(), [&](const Sphere& sphere) {
            return Meets(sphere, box);
          })) {
        continue;
      }
      const std::vector<Eigen::Vector3f> others = blocks_.read_positions(c);
      std::vector<uint32_t> all(others.size()), left;
      std::iota(all.begin(), all.end(), 0u);
      const std::vector<uint32_t> in_use = PlacesIn(c, taken);
      std::set_difference(
          all.begin(), all.end(), in_use.begin(), in_use.end(), std::back_inserter(left));
      const std::vector<uint32_t> places =
          SitesInSpheres(spheres, box, SiteTree(others, std::move(left)));
      is_complete = is_complete && places.empty();
      add(c, others, places);
    }
  }
  std::sort(own.around.begin(), own.around.end());
}

BlockScene BlockScenes::Make(size_t block) {
  Outline& own = outlines_[block];
  if (!own.is_known) FindSitesAround(block);
  Model model = blocks_.run;
  {
    Foam foam = blocks_.read_foam(block);
    CHECK_EQ(foam.NumSites(), own.num_sites);
    foam.classifier_weight = std::move(model.foam.classifier_weight);
    foam.classifier_bias = std::move(model.foam.classifier_bias);
    model.foam = std::move(foam);
  }
  for (size_t c = 0; c < outlines_.size(); ++c) {
    const std::vector<uint32_t> places = PlacesIn(c, own.around);
    if (places.empty()) continue;
    const Foam others = blocks_.read_foam(c);
    AppendRows(others.positions, 1, places, &model.foam.positions);
    AppendRows(others.raw_density, 1, places, &model.foam.raw_density);
    AppendRows(others.sh, others.ShStride(), places, &model.foam.sh);
    if (others.HasSemantics()) {
      AppendRows(others.identity, kIdentityDim, places, &model.foam.identity);
    }
  }
  BlockScene made;
  made.num_own = own.num_sites;
  made.scene = MakeSceneCells(model, options_);
  made.has_camera = CellsWithCameras(model, made.scene);
  made.has_camera.resize(own.num_sites);
  made.ids.resize(own.num_sites);
  std::iota(made.ids.begin(), made.ids.end(), own.first_id);
  made.ids.insert(made.ids.end(), own.around.begin(), own.around.end());
  for (uint32_t guard = 0; guard < kNumGuardSites; ++guard) made.ids.push_back(num_sites_ + guard);
  return made;
}

}  // namespace semfoam
