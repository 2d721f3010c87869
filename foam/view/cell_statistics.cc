// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/view/cell_statistics.h"

#include "foam/model/spherical_harmonics.h"
#include "foam/render/ray_tracer.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace semfoam {
namespace {

// What one ray saw of one cell.
struct CellObservation {
  uint32_t cell;
  float weight;
  // Light that passes the cell and that it stops, as in CellStatistics.
  float passed;
  float stopped;
  Eigen::Vector3f color;
  // Whether the ray's pixel has a class.
  bool is_labelled;
};

// Maximum number of rays whose observations are in memory at a time; the rays of kRowsPerBlock rows
// are, however many they are.
constexpr int kRaysInMemory = 1 << 16;
// Rows of pixels that one thread casts.
constexpr int kRowsPerBlock = 8;

// Rays that a thread casts at a time, however wide a photo is: each trace takes some 10 kB.
constexpr size_t kRaysAtOnce = 256;

// Appends what a ray saw of every cell in which it passed, stopped or showed something.
void AddObservations(const RayTrace& trace,
                     bool is_labelled,
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
                             passed,
                             stopped,
                             {trace.color[0][k], trace.color[1][k], trace.color[2][k]},
                             is_labelled});
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
  // The view's pixels; null: none is taken for labelled.
  const ViewPixels* pixels;
};

// Casts the pixels of rows [begin, end) of the grid.
void ObserveRows(const PixelGrid& grid,
                 int64_t begin,
                 int64_t end,
                 size_t num_sites,
                 std::vector<CellObservation>* observations) {
  const TrainingViews& views = grid.views;
  std::vector<Eigen::Vector3f> directions;
  std::vector<uint8_t> is_labelled;
  for (int64_t row = begin; row < end; ++row) {
    directions.clear();
    is_labelled.clear();
    Eigen::Vector3f direction;
    const int y = static_cast<int>(row * grid.stride);
    for (int x = 0; x < views.Width(grid.view); x += grid.stride) {
      if (!views.RayDirection(grid.view, x, y, &direction)) continue;
      directions.push_back(direction);
      is_labelled.push_back(grid.pixels != nullptr &&
                            grid.pixels->At(x, y).Class() != kUnlabelled);
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
        AddObservations(traces[i], is_labelled[first + i] != 0, num_sites, observations);
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
        labelled_(num_sites, 0.0),
        weighted_color_(num_sites, Eigen::Vector3d::Zero()) {
    statistics_.contribution.assign(num_sites, 0.f);
  }

  void Add(const CellObservation& s) {
    passed_[s.cell] += s.passed;
    stopped_[s.cell] += s.stopped;
    if (!(s.weight > kNegligibleWeight)) return;
    statistics_.contribution[s.cell] = std::max(statistics_.contribution[s.cell], s.weight);
    weight_[s.cell] += s.weight;
    if (s.is_labelled) labelled_[s.cell] += s.weight;
    weighted_color_[s.cell] += s.weight * s.color.cast<double>();
  }

  // Returns the sum of each cell's weights in labelled pixels.
  std::vector<float> Labelled() const { return {labelled_.begin(), labelled_.end()}; }

  // Call it once, after the last Add. Cells that no ray saw get the colour of their constant SH
  // term.
  CellStatistics Finish(const Foam& foam) {
    const size_t n = weight_.size();
    statistics_.passed.assign(passed_.begin(), passed_.end());
    statistics_.stopped.assign(stopped_.begin(), stopped_.end());
    statistics_.mean_color.resize(n);
    for (size_t i = 0; i < n; ++i) {
      const float* sh = &foam.sh[i * foam.ShStride()];
      const Eigen::Vector3f color =
          weight_[i] > 0
              ? Eigen::Vector3f((weighted_color_[i] / weight_[i]).cast<float>())
              : Eigen::Vector3f(Eigen::Vector3f(sh[0], sh[1], sh[2]).array() * float(kShDc) + 0.5f);
      statistics_.mean_color[i] = color.cwiseMax(0.f).cwiseMin(1.f);
    }
    return std::move(statistics_);
  }

 private:
  CellStatistics statistics_;
  std::vector<double> passed_, stopped_;
  std::vector<double> weight_, labelled_;
  std::vector<Eigen::Vector3d> weighted_color_;
};

}  // namespace

int64_t CellStatisticsBytes(int64_t num_sites) {
  // A ray sees more cells, the more there are; some 50 of a million. Arrays double as they grow.
  const double observations = std::min(50.0, std::cbrt(static_cast<double>(num_sites)));
  return static_cast<int64_t>(2 * kRaysInMemory * observations * sizeof(CellObservation));
}

CellStatistics MeasureCells(const Foam& foam,
                            const ViewRenderer& renderer,
                            const TrainingViews& views,
                            int stride,
                            std::vector<float>* labelled) {
  const size_t n = foam.NumSites();
  ObservationSums sums(n);
  const float cutoff_tau = static_cast<float>(-std::log(kTransmittanceCutoff));
  for (int view = 0; view < views.NumViews(); ++view) {
    if (views.IsHeldOut(view)) continue;
    const uint32_t start = renderer.StartCell(views.Origin(view));
    const bool asks_labels = labelled != nullptr && views.HasLabels(view);
    const std::unique_ptr<ViewPixels> pixels = asks_labels ? views.OpenView(view) : nullptr;
    const PixelGrid grid{
        renderer, views, view, stride, start, renderer.shading(), cutoff_tau, pixels.get()};
    const int columns = (views.Width(view) + stride - 1) / stride;
    const int rows = (views.Height(view) + stride - 1) / stride;
    const int rows_in_memory =
        std::max(1, kRaysInMemory / (columns * kRowsPerBlock)) * kRowsPerBlock;
    for (int first_row = 0; first_row < rows; first_row += rows_in_memory) {
      const int num_rows = std::min(rows_in_memory, rows - first_row);
      std::vector<std::vector<CellObservation>> blocks((num_rows + kRowsPerBlock - 1) /
                                                       kRowsPerBlock);
      ParallelForBlocks(num_rows, kRowsPerBlock, [&](int64_t begin, int64_t end) {
        ObserveRows(grid, first_row + begin, first_row + end, n, &blocks[begin / kRowsPerBlock]);
      });
      // In block order, so that the sums are the same on any number of threads.
      for (const std::vector<CellObservation>& observations : blocks) {
        for (const CellObservation& observation : observations) sums.Add(observation);
      }
    }
  }
  if (labelled != nullptr) *labelled = sums.Labelled();
  return sums.Finish(foam);
}

}  // namespace semfoam
