// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/view/cell_statistics.h"

#include "foam/model/spherical_harmonics.h"
#include "foam/render/ray_tracer.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>

namespace semfoam {
namespace {

// What one ray saw of one cell.
struct CellObservation {
  uint32_t cell;
  float weight;
  float passed;
  float stopped;
  Eigen::Vector3f color;
};

// Rays cast between two sums: what they see is held in memory.
constexpr int kRaysInMemory = 1 << 16;
constexpr int kRowsPerBlock = 8;

// Rays that a thread casts at a time, however wide a photo is: each trace takes some 10 kB.
constexpr size_t kRaysAtOnce = 256;

void AddObservations(const RayTrace& trace,
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
                             {trace.color[0][k], trace.color[1][k], trace.color[2][k]}});
  }
}

}  // namespace

int64_t CellStatisticsBytes(int64_t num_sites) {
  // A ray sees more cells, the more there are; some 50 of a million. Arrays double as they grow.
  const double observations = std::min(50.0, std::cbrt(static_cast<double>(num_sites)));
  return static_cast<int64_t>(2 * kRaysInMemory * observations * sizeof(CellObservation));
}

CellStatistics MeasureCells(const Foam& foam,
                            const ViewRenderer& renderer,
                            const TrainingViews& views,
                            int stride) {
  const size_t n = foam.NumSites();
  CellStatistics statistics;
  statistics.contribution.assign(n, 0.f);
  std::vector<double> passed(n, 0.0), stopped(n, 0.0);
  std::vector<double> weight_sum(n, 0.0);
  std::vector<Eigen::Vector3d> color_sum(n, Eigen::Vector3d::Zero());
  const CellShading<float> shading = renderer.shading();
  const float cutoff_tau = static_cast<float>(-std::log(kTransmittanceCutoff));

  for (int view = 0; view < views.NumViews(); ++view) {
    if (views.IsHeldOut(view)) continue;
    const uint32_t start = renderer.StartCell(views.Origin(view));
    const int columns = (views.Width(view) + stride - 1) / stride;
    const int rows = (views.Height(view) + stride - 1) / stride;
    const int rows_in_memory =
        std::max(1, kRaysInMemory / (columns * kRowsPerBlock)) * kRowsPerBlock;
    for (int first_row = 0; first_row < rows; first_row += rows_in_memory) {
      const int num_rows = std::min(rows_in_memory, rows - first_row);
      std::vector<std::vector<CellObservation>> blocks((num_rows + kRowsPerBlock - 1) /
                                                       kRowsPerBlock);
      ParallelForBlocks(num_rows, kRowsPerBlock, [&](int64_t begin, int64_t end) {
        std::vector<CellObservation>& observations = blocks[begin / kRowsPerBlock];
        std::vector<Eigen::Vector3f> directions;
        for (int64_t row = first_row + begin; row < first_row + end; ++row) {
          directions.clear();
          Eigen::Vector3f direction;
          for (int x = 0; x < views.Width(view); x += stride) {
            if (views.RayDirection(view, x, static_cast<int>(row * stride), &direction)) {
              directions.push_back(direction);
            }
          }
          for (size_t first = 0; first < directions.size(); first += kRaysAtOnce) {
            const std::span<RayTrace> traces =
                ThreadTraces(std::min(kRaysAtOnce, directions.size() - first));
            for (size_t i = 0; i < traces.size(); ++i) {
              traces[i].origin = views.Origin(view).cast<float>();
              traces[i].direction = directions[first + i];
              traces[i].start_cell = start;
            }
            TraceRays(renderer.geometry(), shading, cutoff_tau, traces);
            for (const RayTrace& trace : traces) AddObservations(trace, n, &observations);
          }
        }
      });
      // In block order, so that the sums are the same on any number of threads.
      for (const std::vector<CellObservation>& observations : blocks) {
        for (const CellObservation& s : observations) {
          passed[s.cell] += s.passed;
          stopped[s.cell] += s.stopped;
          if (!(s.weight > kNegligibleWeight)) continue;
          statistics.contribution[s.cell] = std::max(statistics.contribution[s.cell], s.weight);
          weight_sum[s.cell] += s.weight;
          color_sum[s.cell] += s.weight * s.color.cast<double>();
        }
      }
    }
  }

  statistics.passed.assign(passed.begin(), passed.end());
  statistics.stopped.assign(stopped.begin(), stopped.end());
  statistics.mean_color.resize(n);
  for (size_t i = 0; i < n; ++i) {
    const float* sh = &foam.sh[i * foam.ShStride()];
    const Eigen::Vector3f color =
        weight_sum[i] > 0
            ? Eigen::Vector3f((color_sum[i] / weight_sum[i]).cast<float>())
            : Eigen::Vector3f(Eigen::Vector3f(sh[0], sh[1], sh[2]).array() * float(kShDc) + 0.5f);
    statistics.mean_color[i] = color.cwiseMax(0.f).cwiseMin(1.f);
  }
  return statistics;
}

}  // namespace semfoam
