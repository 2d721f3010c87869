// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/view/cell_statistics.h"

#include "foam/geometry/voronoi.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/render/ray_tracer.h"
#include "foam/util/parallel.h"
#include "foam/view/ray_density.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

namespace semfoam {
namespace {

// What one ray saw of one cell.
struct CellObservation {
  uint32_t cell;
  float weight;
  // Transmittance where the ray enters the cell.
  float transmittance;
  // Light that passes the cell and that it stops, as in CellStatistics.
  float passed;
  float stopped;
  Eigen::Vector3f color;
  // Of the ray's pixel; kUnlabelled unless asked for.
  ClassIndex class_index;
};

// Maximum number of rays whose observations are in memory at a time; the rays of kRowsPerBlock rows
// are, however many they are.
constexpr int kRaysInMemory = 1 << 16;
// Least weight of a cell on a ray for which the ray's pixel votes. At the edges of things a pixel
// also shows a little of what is behind them, and in haze a little of everything.
constexpr float kLeastVote = 0.3f;
// Rows of pixels that one thread casts.
constexpr int kRowsPerBlock = 8;

// Rays that a thread casts at a time, however wide a photo is: each trace takes some 10 kB.
constexpr size_t kRaysAtOnce = 256;

// Appends what a ray saw of every cell in which it passed, stopped or showed something.
void AddObservations(const RayTrace& trace,
                     ClassIndex class_index,
                     size_t num_sites,
                     std::vector<CellObservation>* observations) {
  for (int k = 0; k < trace.num_segments; ++k) {
    const float before = std::exp(-trace.segments[k].tau_in);
    const float behind = trace.transmittance[k];
    const float passed = 2 * std::max(behind - 0.5f, 0.f);
    const float stopped = 2 * std::max(std::min(before, 0.5f) - behind, 0.f);
    if (passed == 0 && stopped == 0 && !(trace.weight[k] > kNegligibleWeight)) continue;
    if (trace.segments[k].cell >= num_sites) continue;  // a guard
    observations->push_back({trace.segments[k].cell,
                             trace.weight[k],
                             before,
                             passed,
                             stopped,
                             {trace.color[0][k], trace.color[1][k], trace.color[2][k]},
                             class_index});
  }
}

// The pixels of a view that are cast, and how.
struct PixelGrid {
  const ViewRenderer& renderer;
  const TrainingViews& views;
  int view;
  int stride;
  uint32_t start_cell;
  CellShading<float> shading;
  float cutoff_tau;
  // Whether the pixels' classes are asked for.
  bool asks_classes;
  // The view's pixels where the views do not hold them and their classes are asked for.
  const ViewPixels* pixels;
  RayFilter casts = {};

  // Returns whether the pixel is cast, and its ray's direction.
  bool Direction(int x, int y, Eigen::Vector3f* direction) const {
    return views.RayDirection(view, x, y, direction) &&
           (!casts || casts(views.Origin(view).cast<float>(), *direction));
  }

  ClassIndex ClassAt(int x, int y) const {
    if (!asks_classes) return kUnlabelled;
    if (pixels != nullptr) return pixels->At(x, y).Class();
    TrainingRay ray;
    return views.Ray(view, x, y, &ray) ? ray.class_index : kUnlabelled;
  }
};

// Casts the pixels of rows [begin, end) of the grid.
void ObserveRows(const PixelGrid& grid,
                 int64_t begin,
                 int64_t end,
                 size_t num_sites,
                 std::vector<CellObservation>* observations) {
  const TrainingViews& views = grid.views;
  std::vector<Eigen::Vector3f> directions;
  std::vector<ClassIndex> classes;
  for (int64_t row = begin; row < end; ++row) {
    directions.clear();
    classes.clear();
    Eigen::Vector3f direction;
    const int y = static_cast<int>(row * grid.stride);
    for (int x = 0; x < views.Width(grid.view); x += grid.stride) {
      if (!grid.Direction(x, y, &direction)) continue;
      directions.push_back(direction);
      classes.push_back(grid.ClassAt(x, y));
    }
    for (size_t first = 0; first < directions.size(); first += kRaysAtOnce) {
      const std::span<RayTrace> traces =
          ThreadTraces(std::min(kRaysAtOnce, directions.size() - first));
      for (size_t i = 0; i < traces.size(); ++i) {
        traces[i].origin = views.Origin(grid.view).cast<float>();
        traces[i].direction = directions[first + i];
        traces[i].start_cell = grid.start_cell;
      }
      TraceRays(grid.renderer.geometry(), grid.shading, grid.cutoff_tau, traces);
      for (size_t i = 0; i < traces.size(); ++i) {
        AddObservations(traces[i], classes[first + i], num_sites, observations);
      }
    }
  }
}

// Adds up what all rays see, per cell.
class ObservationSums {
 public:
  explicit ObservationSums(size_t num_sites)
      : passed_(num_sites, 0.0),
        stopped_(num_sites, 0.0),
        weight_(num_sites, 0.0),
        weighted_color_(num_sites, Eigen::Vector3d::Zero()) {
    measured_.statistics.contribution.assign(num_sites, 0.f);
    measured_.transmittance.assign(num_sites, 0.f);
  }

  void Add(const CellObservation& s) {
    passed_[s.cell] += s.passed;
    stopped_[s.cell] += s.stopped;
    float& transmittance = measured_.transmittance[s.cell];
    transmittance = std::max(transmittance, s.transmittance);
    if (!(s.weight > kNegligibleWeight)) return;
    float& contribution = measured_.statistics.contribution[s.cell];
    contribution = std::max(contribution, s.weight);
    weight_[s.cell] += s.weight;
    weighted_color_[s.cell] += s.weight * s.color.cast<double>();
  }

  // Call it once, after the last Add. Cells that no ray saw get the colour of their constant SH
  // term.
  CellMeasurements Finish(const Foam& foam) {
    CellStatistics& statistics = measured_.statistics;
    const size_t n = weight_.size();
    measured_.weight.assign(weight_.begin(), weight_.end());
    statistics.passed.assign(passed_.begin(), passed_.end());
    statistics.stopped.assign(stopped_.begin(), stopped_.end());
    statistics.mean_color.resize(n);
    for (size_t i = 0; i < n; ++i) {
      const float* sh = &foam.sh[i * foam.ShStride()];
      const Eigen::Vector3f color =
          weight_[i] > 0
              ? Eigen::Vector3f((weighted_color_[i] / weight_[i]).cast<float>())
              : Eigen::Vector3f(Eigen::Vector3f(sh[0], sh[1], sh[2]).array() * float(kShDc) + 0.5f);
      statistics.mean_color[i] = color.cwiseMax(0.f).cwiseMin(1.f);
    }
    return std::move(measured_);
  }

 private:
  CellMeasurements measured_;
  std::vector<double> passed_, stopped_;
  std::vector<double> weight_;
  std::vector<Eigen::Vector3d> weighted_color_;
};

PixelGrid MakeGrid(const ViewRenderer& renderer,
                   const TrainingViews& views,
                   int view,
                   int stride,
                   bool asks_classes,
                   const ViewPixels* pixels) {
  return {renderer,
          views,
          view,
          stride,
          renderer.StartCell(views.Origin(view)),
          renderer.shading(),
          static_cast<float>(-std::log(kTransmittanceCutoff)),
          asks_classes,
          pixels};
}

// Calls add(observation) for all observations of the grid's rays, in an order that does not depend
// on the number of threads.
template <typename Add>
void ForEachObservation(const PixelGrid& grid, size_t num_sites, Add&& add) {
  const int columns = (grid.views.Width(grid.view) + grid.stride - 1) / grid.stride;
  const int rows = (grid.views.Height(grid.view) + grid.stride - 1) / grid.stride;
  const int rows_in_memory = std::max(1, kRaysInMemory / (columns * kRowsPerBlock)) * kRowsPerBlock;
  for (int first_row = 0; first_row < rows; first_row += rows_in_memory) {
    const int num_rows = std::min(rows_in_memory, rows - first_row);
    std::vector<std::vector<CellObservation>> blocks((num_rows + kRowsPerBlock - 1) /
                                                     kRowsPerBlock);
    ParallelForBlocks(num_rows, kRowsPerBlock, [&](int64_t begin, int64_t end) {
      ObserveRows(
          grid, first_row + begin, first_row + end, num_sites, &blocks[begin / kRowsPerBlock]);
    });
    for (const std::vector<CellObservation>& observations : blocks) {
      for (const CellObservation& observation : observations) add(observation);
    }
  }
}

// Adds to each cell the number of the grid's rays towards the ball of radius `radii` around its
// site. A ball in which the camera is takes half of all directions.
void AddPotentialRays(const PixelGrid& grid,
                      const std::vector<Eigen::Vector3f>& positions,
                      const std::vector<float>& radii,
                      RayDensity* density,
                      std::vector<float>* potential_rays) {
  const TrainingViews& views = grid.views;
  density->Clear();
  Eigen::Vector3f direction;
  for (int y = 0; y < views.Height(grid.view); y += grid.stride) {
    for (int x = 0; x < views.Width(grid.view); x += grid.stride) {
      if (views.RayDirection(grid.view, x, y, &direction)) density->Add(direction);
    }
  }
  const Eigen::Vector3f origin = views.Origin(grid.view).cast<float>();
  constexpr float kPi = std::numbers::pi_v<float>;
  ParallelForBlocks(std::ssize(positions), 4096, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const Eigen::Vector3f to_site = positions[i] - origin;
      const float squared_distance = to_site.squaredNorm();
      if (!(squared_distance > 0)) continue;
      const float solid_angle = std::min(kPi * radii[i] * radii[i] / squared_distance, 2 * kPi);
      (*potential_rays)[i] += solid_angle * density->At(to_site);
    }
  });
}

// Sorts votes by cell, then class, and adds up those of the same cell and class, in their order.
void AddUpVotes(std::vector<LabelVote>* votes) {
  std::stable_sort(votes->begin(), votes->end(), [](const LabelVote& a, const LabelVote& b) {
    return std::pair(a.cell, a.class_index) < std::pair(b.cell, b.class_index);
  });
  size_t count = 0;
  for (const LabelVote& vote : *votes) {
    if (count > 0 && (*votes)[count - 1].cell == vote.cell &&
        (*votes)[count - 1].class_index == vote.class_index) {
      (*votes)[count - 1].weight += vote.weight;
    } else {
      (*votes)[count++] = vote;
    }
  }
  votes->resize(count);
}

}  // namespace

int64_t CellStatisticsBytes(int64_t num_sites) {
  // A ray sees more cells, the more there are; some 50 of a million. Arrays double as they grow.
  const double observations = std::min(50.0, std::cbrt(static_cast<double>(num_sites)));
  return static_cast<int64_t>(2 * kRaysInMemory * observations * sizeof(CellObservation));
}

CellMeasurements MeasureCells(const Foam& foam,
                              const ViewRenderer& renderer,
                              const TrainingViews& views,
                              int stride,
                              const RayFilter& casts) {
  const size_t n = foam.NumSites();
  ObservationSums sums(n);
  const std::vector<float> radii = CellRadii(renderer.geometry().positions, renderer.delaunay());
  std::vector<float> potential_rays(n, 0.f);
  RayDensity density;
  for (int view = 0; view < views.NumViews(); ++view) {
    if (views.IsHeldOut(view)) continue;
    PixelGrid grid =
        MakeGrid(renderer, views, view, stride, /*asks_classes=*/false, /*pixels=*/nullptr);
    grid.casts = casts;
    ForEachObservation(grid, n, [&](const CellObservation& observation) { sums.Add(observation); });
    AddPotentialRays(grid, foam.positions, radii, &density, &potential_rays);
  }
  CellMeasurements measured = sums.Finish(foam);
  measured.potential_rays = std::move(potential_rays);
  return measured;
}

std::vector<LabelVote> MeasureLabels(const Foam& foam,
                                     const ViewRenderer& renderer,
                                     const TrainingViews& views,
                                     int stride) {
  const float pixels_of_ray = static_cast<float>(stride) * static_cast<float>(stride);
  std::vector<LabelVote> votes;
  for (int view = 0; view < views.NumViews(); ++view) {
    if (views.IsHeldOut(view) || !views.HasLabels(view)) continue;
    const std::unique_ptr<ViewPixels> pixels = views.HoldsPixels() ? nullptr : views.OpenView(view);
    ForEachObservation(
        MakeGrid(renderer, views, view, stride, /*asks_classes=*/true, pixels.get()),
        foam.NumSites(),
        [&](const CellObservation& observation) {
          if (observation.class_index == kUnlabelled) return;
          if (observation.weight < kLeastVote) return;
          votes.push_back(
              {observation.cell, observation.class_index, pixels_of_ray * observation.weight});
        });
    AddUpVotes(&votes);
  }
  return votes;
}

}  // namespace semfoam
