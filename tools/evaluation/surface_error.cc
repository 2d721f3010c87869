// SPDX-License-Identifier: GPL-3.0-or-later
#include "tools/evaluation/surface_error.h"

#include "foam/render/ray_tracer.h"
#include "foam/util/median.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace semfoam {
namespace {

constexpr int64_t kRaysPerBlock = 64;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The part of a ray in a box: from t_in, at least 0, to t_out; none where t_in is not less.
struct RayInBox {
  double t_in = 0;
  double t_out = kInfinity;
};

RayInBox ClipToBox(const Eigen::AlignedBox3d& box,
                   const Eigen::Vector3d& origin,
                   const Eigen::Vector3d& direction) {
  RayInBox part;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (box.min()[axis] - origin[axis]) / direction[axis];
    const double b = (box.max()[axis] - origin[axis]) / direction[axis];
    // NaN (a ray in the plane of a side) leaves the bounds as they are.
    part.t_in = std::max(part.t_in, std::min(a, b));
    part.t_out = std::min(part.t_out, std::max(a, b));
  }
  return part;
}

// Returns the distance at which the transmittance of a ray through the voxels of the scene's volume
// falls to 1/2; 0 where it does not. `*cell` is the cell from which the search for the first
// voxel's cell starts, and is set to the cell of the last voxel. Traverses the voxels by Amanatides
// and Woo 1987; voxel v is centred on origin + size v.
float DistanceInVoxels(const ExportableScene& scene,
                       const VolumeFrame& frame,
                       float min_optical_depth,
                       const Eigen::Vector3d& origin,
                       const Eigen::Vector3d& direction,
                       uint32_t* cell) {
  const double size = frame.lattice.voxel_size;
  const double half_lost = std::log(2.0);
  auto [t, last] = ClipToBox(frame.box, origin, direction);
  Eigen::Vector3d voxel, next, step;
  const Eigen::Vector3d entry = origin + t * direction;
  for (int axis = 0; axis < 3; ++axis) {
    const double at = (entry[axis] - frame.lattice.origin[axis]) / size;
    voxel[axis] = std::floor(at + 0.5);
    step[axis] = direction[axis] < 0 ? -1 : 1;
    next[axis] = direction[axis] == 0
                     ? kInfinity
                     : t + (voxel[axis] + 0.5 * step[axis] - at) * size / direction[axis];
  }
  for (double tau = 0; t < last;) {
    int axis;
    const double out = std::min(next.minCoeff(&axis), last);
    *cell = NearestCell(
        scene.cell_positions, scene.delaunay, frame.lattice.origin + size * voxel, *cell);
    const bool is_matter =
        *cell < scene.NumSites() && scene.density[*cell] * scene.radius[*cell] >= min_optical_depth;
    const double density = is_matter ? scene.density[*cell] : 0;
    if (tau + density * (out - t) >= half_lost) {
      return static_cast<float>(t + (half_lost - tau) / density);
    }
    tau += density * (out - t);
    t = out;
    voxel[axis] += step[axis];
    next[axis] += size / std::abs(direction[axis]);
  }
  return 0;
}

}  // namespace

std::vector<DepthView> MakeDepthViews(const Reconstruction& reconstruction,
                                      const std::vector<PhotoRecord>& photos,
                                      const Similarity& world_from_normalized) {
  std::set<std::string> held_out;
  for (const PhotoRecord& photo : photos) {
    if (photo.held_out) held_out.insert(photo.name);
  }
  std::map<uint32_t, DepthView> view_of_image;
  for (const Image& image : reconstruction.images) {
    if (!held_out.contains(image.name)) continue;
    view_of_image[image.id].origin = world_from_normalized.Invert(image.cam_from_world.Center());
  }
  for (const Point3D& point : reconstruction.points) {
    if (!point.position.allFinite()) continue;
    const Eigen::Vector3d position = world_from_normalized.Invert(point.position);
    std::set<uint32_t> seen;  // a track may name an image twice
    for (const TrackElement& element : point.track) {
      const auto view = view_of_image.find(element.image_id);
      if (view == view_of_image.end() || !seen.insert(element.image_id).second) continue;
      const Eigen::Vector3d offset = position - view->second.origin;
      const double distance = offset.norm();
      if (!(distance > 0)) continue;
      view->second.directions.push_back((offset / distance).cast<float>());
      view->second.distances.push_back(distance);
    }
  }
  std::vector<DepthView> views;
  for (auto& [id, view] : view_of_image) {
    if (!view.distances.empty()) views.push_back(std::move(view));
  }
  return views;
}

std::vector<DepthView> Within(const std::vector<DepthView>& views, const Eigen::AlignedBox3d& box) {
  std::vector<DepthView> within;
  for (const DepthView& view : views) {
    DepthView kept{view.origin, {}, {}};
    for (size_t i = 0; i < view.distances.size(); ++i) {
      const Eigen::Vector3d point =
          view.origin + view.distances[i] * view.directions[i].cast<double>();
      if (!box.contains(point)) continue;
      kept.directions.push_back(view.directions[i]);
      kept.distances.push_back(view.distances[i]);
    }
    if (!kept.distances.empty()) within.push_back(std::move(kept));
  }
  return within;
}

std::vector<float> FoamDistances(const ViewRenderer& renderer, const DepthView& view) {
  return renderer
      .Render({static_cast<int>(view.directions.size()), 1, view.origin, view.directions})
      .distance;
}

std::vector<float> CellSurfaceDistances(const ViewRenderer& renderer,
                                        const ExportableScene& scene,
                                        const DepthView& view) {
  const uint32_t start = renderer.StartCell(view.origin);
  const CellShading<float> shading = renderer.shading();
  std::vector<float> distances(view.directions.size(), 0);
  ParallelForBlocks(
      static_cast<int64_t>(distances.size()), kRaysPerBlock, [&](int64_t begin, int64_t end) {
        const std::span<RayTrace> traces = ThreadTraces(end - begin);
        for (int64_t i = begin; i < end; ++i) {
          traces[i - begin].origin = view.origin.cast<float>();
          traces[i - begin].direction = view.directions[i];
          traces[i - begin].start_cell = start;
        }
        // To the end of the foam: an object may stand behind matter that is none.
        TraceRays(renderer.geometry(), shading, std::numeric_limits<float>::infinity(), traces);
        for (int64_t i = begin; i < end; ++i) {
          const RayTrace& trace = traces[i - begin];
          float entered = 0;
          for (int k = 0; k < trace.num_segments; ++k) {
            const uint32_t cell = trace.segments[k].cell;
            if (cell < scene.NumSites() && scene.object_of_cell[cell] >= 0) {
              distances[i] = entered;
              break;
            }
            entered = trace.segments[k].t_out;
          }
        }
      });
  return distances;
}

std::vector<float> VolumeDistances(const ExportableScene& scene,
                                   const VolumeFrame& frame,
                                   float min_optical_depth,
                                   const DepthView& view) {
  std::vector<float> distances(view.directions.size(), 0);
  ParallelForBlocks(
      static_cast<int64_t>(distances.size()), kRaysPerBlock, [&](int64_t begin, int64_t end) {
        uint32_t cell = 0;
        for (int64_t i = begin; i < end; ++i) {
          distances[i] = DistanceInVoxels(scene,
                                          frame,
                                          min_optical_depth,
                                          view.origin,
                                          view.directions[i].cast<double>(),
                                          &cell);
        }
      });
  return distances;
}

double SurfaceError(const std::vector<DepthView>& views, const DistancesOf& distances_of) {
  std::vector<double> errors;
  for (const DepthView& view : views) {
    const std::vector<float> distances = distances_of(view);
    for (size_t i = 0; i < distances.size(); ++i) {
      errors.push_back(distances[i] > 0 ? std::abs(distances[i] - view.distances[i]) : kInfinity);
    }
  }
  if (errors.empty()) return std::numeric_limits<double>::quiet_NaN();
  return Median(std::move(errors));
}

}  // namespace semfoam
