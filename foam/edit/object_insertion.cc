// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/edit/object_insertion.h"

#include "foam/edit/class_table.h"
#include "foam/edit/model_sites.h"
#include "foam/geometry/guard_sites.h"
#include "foam/geometry/voronoi.h"
#include "foam/model/activation.h"
#include "foam/model/sh_rotation.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/optim/optimizer.h"
#include "foam/util/error.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <glog/logging.h>

namespace semfoam {
namespace {

// How far from an object's site its cell is taken at its word, in its radii. Beyond are spikes into
// what was empty space around it, which may be anything in another scene.
constexpr float kCellReach = 3;
// A site of the scene does the work of a ring site if it is so near to it, as a share of the
// distance from that to the object.
constexpr float kStandInShare = 0.1f;

// The placed objects among their ring, as cells.
class ObjectSpace {
 public:
  explicit ObjectSpace(const ExtractedObjects& placed)
      : placed_(placed),
        cells_(WithGuardSites(placed.model.foam.positions)),
        delaunay_(Triangulate(cells_)),
        radii_(CellRadii(cells_, delaunay_)),
        circumcenters_(VoronoiVertices(cells_, delaunay_)),
        tets_(ListTetsOfCells(delaunay_)) {
    for (uint32_t i = 0; i < delaunay_.num_sites; ++i) {
      if (!IsObject(i)) continue;
      const Eigen::Vector3f reach = Eigen::Vector3f::Constant(kCellReach * radii_[i]);
      box_.extend(cells_[i] - reach);
      box_.extend(cells_[i] + reach);
    }
  }

  bool IsObject(uint32_t cell) const {
    return cell < delaunay_.num_sites && placed_.object_of_site[cell] >= 0;
  }
  const Delaunay& delaunay() const { return delaunay_; }
  const Eigen::Vector3f& Position(uint32_t cell) const { return cells_[cell]; }

  // Returns whether a site at x would be in an object, or cut into one: it lies in the sphere
  // through an object's cell and three of its neighbours, which is empty in the object's own
  // triangulation.
  bool IsTaken(const Eigen::Vector3f& x) {
    if (!box_.contains(x)) return false;
    last_ = NearestCell(cells_, delaunay_, x.cast<double>(), last_);
    if (IsObject(last_)) {
      return (x - cells_[last_]).norm() <= kCellReach * radii_[last_];
    }
    const auto around = delaunay_.Neighbors(last_);
    return std::any_of(around.begin(), around.end(), [&](uint32_t cell) {
      return IsObject(cell) && CutsInto(x, cell);
    });
  }

 private:
  bool CutsInto(const Eigen::Vector3f& x, uint32_t object) const {
    if ((x - cells_[object]).norm() > kCellReach * radii_[object]) return false;
    for (const uint32_t tet : tets_.Of(object)) {
      const double radius_squared =
          (cells_[object].cast<double>() - circumcenters_[tet]).squaredNorm();
      // Sites on the sphere itself, to rounding, are the ring's own.
      if ((x.cast<double>() - circumcenters_[tet]).squaredNorm() < (1 - 1e-5) * radius_squared) {
        return true;
      }
    }
    return false;
  }

  const ExtractedObjects& placed_;
  std::vector<Eigen::Vector3f> cells_;
  Delaunay delaunay_;
  std::vector<float> radii_;
  std::vector<Eigen::Vector3d> circumcenters_;
  TetsOfCells tets_;
  Eigen::AlignedBox3f box_;
  uint32_t last_ = 0;
};

// Whether a label has no embedding, or one as long as those of `labels`: embeddings of another
// encoder cannot be compared with them.
bool MayHaveEmbedding(const Label& label, const std::vector<Label>& labels) {
  return std::all_of(labels.begin(), labels.end(), [&](const Label& other) {
    return label.features.embedding.empty() || other.features.embedding.empty() ||
           label.features.embedding.size() == other.features.embedding.size();
  });
}

// Sites to be: each takes everything but its place from a site of the scene.
struct NewSites {
  std::vector<uint32_t> origin;
  std::vector<Eigen::Vector3f> positions;

  void Add(uint32_t from, const Eigen::Vector3f& position) {
    origin.push_back(from);
    positions.push_back(position);
  }
};

// The ring sites that the scene needs, with what the scene has at their places. Where it has
// nothing, beyond all its sites, the ring site itself: `own_sites`.
size_t AddRing(const Model& scene,
               const Delaunay& delaunay,
               const std::vector<uint8_t>& is_removed,
               const ObjectSpace& objects,
               NewSites* sites,
               std::vector<uint32_t>* own_sites) {
  const std::vector<Eigen::Vector3f> cells = WithGuardSites(scene.foam.positions);
  size_t count = 0;
  uint32_t at = 0;
  for (uint32_t i = 0; i < objects.delaunay().num_sites; ++i) {
    if (objects.IsObject(i)) continue;
    const Eigen::Vector3f& x = objects.Position(i);
    float to_object = std::numeric_limits<float>::infinity();
    for (const uint32_t j : objects.delaunay().Neighbors(i)) {
      if (objects.IsObject(j)) to_object = std::min(to_object, (objects.Position(j) - x).norm());
    }
    if (!std::isfinite(to_object)) continue;  // bounds no object any more
    at = NearestCell(cells, delaunay, x.cast<double>(), at);
    ++count;
    if (at >= delaunay.num_sites) {
      own_sites->push_back(i);
    } else if (is_removed[at] || (cells[at] - x).norm() > kStandInShare * to_object) {
      sites->Add(at, x);
    } else {
      --count;
    }
  }
  return count;
}

// Returns the sites of `placed` in `sites`, with `feature`, as rows for `model`.
Model RowsFor(const Model& model,
              const ExtractedObjects& placed,
              const std::vector<uint32_t>& sites,
              const IdentityFeature& feature) {
  Model rows = WithSites(placed.model, sites);
  rows.foam.identity.clear();
  if (!model.foam.HasSemantics()) return rows;
  for (size_t i = 0; i < sites.size(); ++i) {
    rows.foam.identity.insert(rows.foam.identity.end(), feature.begin(), feature.end());
  }
  return rows;
}

}  // namespace

ExtractedObjects PlaceObjects(ExtractedObjects objects,
                              const ObjectPlacement& placement,
                              const Model& scene) {
  Model& model = objects.model;
  const Similarity& from = model.world_from_normalized;
  const Similarity& to = scene.world_from_normalized;
  const double scale = placement.scale * from.scale / to.scale;
  const Eigen::Vector3d offset = to.Invert(placement.Apply(from.translation));
  std::vector<uint32_t> kept;
  std::vector<int32_t> object_of_kept;
  for (uint32_t i = 0; i < model.foam.NumSites(); ++i) {
    Eigen::Vector3f& x = model.foam.positions[i];
    const Eigen::Vector3d moved = scale * (placement.rotation * x.cast<double>()) + offset;
    const bool is_near = moved.norm() <= kFarRadius;
    if (!is_near && objects.object_of_site[i] >= 0) {
      const Eigen::Vector3d x_world = to.Apply(moved);
      throw UserError("The object would reach ",
                      moved.norm() * to.scale,
                      " from the middle of the scene, to (",
                      x_world.x(),
                      ", ",
                      x_world.y(),
                      ", ",
                      x_world.z(),
                      "); a foam ends at ",
                      kFarRadius * to.scale,
                      ", so place it nearer, or make it smaller.");
    }
    if (!is_near) continue;
    x = moved.cast<float>();
    kept.push_back(i);
    object_of_kept.push_back(objects.object_of_site[i]);
  }
  if (scale != 1) {
    for (float& raw : model.foam.raw_density) {
      raw = static_cast<float>(
          std::max<double>(RawDensity(Density<double>(raw) / scale), kTransparentRawDensity));
    }
  }
  for (size_t k = 0; k < model.foam.color_gradient.size(); k += kColorGradientDim) {
    // Rows are axes.
    using Gradient = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;
    Eigen::Map<Gradient> gradient(&model.foam.color_gradient[k]);
    gradient = (placement.rotation * gradient.cast<double>() / scale).cast<float>().eval();
  }
  if (placement.rotation != Eigen::Matrix3d::Identity()) {
    const ShRotation turn(model.foam.sh_degree, placement.rotation);
    for (size_t i = 0; i < model.foam.NumSites(); ++i) {
      turn.Apply(&model.foam.sh[i * model.foam.ShStride()]);
    }
  }
  MatchStatistics(scene.statistics, &model);
  RaiseShDegree(std::max(scene.foam.sh_degree, model.foam.sh_degree), &model.foam);
  model.world_from_normalized = to;
  return {WithSites(model, kept), std::move(object_of_kept)};
}

Insertion InsertObjects(const Model& scene,
                        const Delaunay& delaunay,
                        const ExtractedObjects& placed) {
  const size_t num_objects = placed.model.labels.size();
  ObjectSpace objects(placed);
  Insertion insertion;

  std::vector<uint8_t> is_removed(delaunay.num_sites, 0);
  NewSites sites;
  for (uint32_t i = 0; i < delaunay.num_sites; ++i) {
    is_removed[i] = objects.IsTaken(scene.foam.positions[i]);
    insertion.num_removed += is_removed[i];
    if (!is_removed[i]) sites.Add(i, scene.foam.positions[i]);
  }
  std::vector<uint32_t> own_ring;
  insertion.num_ring_sites = AddRing(scene, delaunay, is_removed, objects, &sites, &own_ring);

  Model& model = insertion.model;
  model = WithSites(scene, sites.origin);
  // What is assumed where no photo looks would hide an object that is put there.
  model.foam.assumed_density.clear();
  if (model.foam.HasColorGradients()) {
    for (size_t i = 0; i < sites.positions.size(); ++i) {
      ShiftColor(sites.positions[i] - model.foam.positions[i],
                 &model.foam.color_gradient[i * kColorGradientDim],
                 &model.foam.sh[i * model.foam.ShStride()]);
    }
  }
  model.foam.positions = std::move(sites.positions);
  RaiseShDegree(placed.model.foam.sh_degree, &model.foam);
  AppendSites(RowsFor(model, placed, own_ring, IdentityFeature{}), &model);
  std::vector<std::vector<uint32_t>> sites_of_object(num_objects);
  for (uint32_t i = 0; i < placed.object_of_site.size(); ++i) {
    // Of sites that have come to lie in the same place, one has a cell.
    if (objects.IsObject(i) && !objects.delaunay().Neighbors(i).empty()) {
      sites_of_object[placed.object_of_site[i]].push_back(i);
    }
  }
  for (size_t k = 0; k < num_objects; ++k) {
    Label label = WithFreeId(model.labels, placed.model.labels[k]);
    if (!MayHaveEmbedding(label, model.labels)) label.features.embedding.clear();
    const IdentityFeature feature = AddClass(label, &model);
    AppendSites(RowsFor(model, placed, sites_of_object[k], feature), &model);
    insertion.labels.push_back(label);
  }
  SortSites(&model);
  return insertion;
}

}  // namespace semfoam
