// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/space_blocks.h"

#include "foam/model/activation.h"
#include "foam/model/cell_labels.h"
#include "foam/render/ray_tracer.h"
#include "foam/util/median.h"
#include "foam/util/parallel.h"
#include "foam/util/random.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>

#include <glog/logging.h>

namespace semfoam {
namespace {

// Of rays that only pass through a block, one square in so many is drawn.
constexpr uint64_t kPassingSquares = 8;
constexpr uint64_t kPassingPurpose = 0x4b1;

// Rays of a square that are looked at, in x and in y.
constexpr int kLooksAcross = 2;
// Rays that a thread traces together.
constexpr int64_t kLooksAtOnce = 256;

// Returns the sum of the weights of these sites.
double SumOf(const std::vector<double>& weights, const std::vector<uint32_t>& sites) {
  double sum = 0;
  for (const uint32_t i : sites) sum += weights[i];
  return sum;
}

// Returns where to cut the axis so that the `parts` have about the same weight; ascending, [parts -
// 1]. Sorts `chosen` along the axis.
std::vector<float> Cuts(const std::vector<Eigen::Vector3f>& sites,
                        const std::vector<double>& weights,
                        int axis,
                        int parts,
                        std::vector<uint32_t>* chosen) {
  std::sort(chosen->begin(), chosen->end(), [&](uint32_t a, uint32_t b) {
    return std::pair(sites[a][axis], a) < std::pair(sites[b][axis], b);
  });
  const double total = SumOf(weights, *chosen);
  std::vector<float> cuts;
  double sum = 0;
  for (const uint32_t i : *chosen) {
    while (static_cast<int>(cuts.size()) < parts - 1 &&
           sum >= total * static_cast<double>(cuts.size() + 1) / parts) {
      cuts.push_back(sites[i][axis]);
    }
    sum += weights[i];
  }
  while (static_cast<int>(cuts.size()) < parts - 1) {
    cuts.push_back(cuts.empty() ? 0.f : cuts.back());
  }
  return cuts;
}

// Returns the distance along the axis in which the middle eight tenths of the weight lie.
double Spread(const std::vector<Eigen::Vector3f>& sites,
              const std::vector<double>& weights,
              int axis,
              std::vector<uint32_t>* all) {
  const std::vector<float> cuts = Cuts(sites, weights, axis, 10, all);
  return double(cuts.back()) - cuts.front();
}

// The axes, those first along which the weights spread farther, and how far.
struct SpreadAxes {
  std::array<int, 3> axes = {0, 1, 2};
  std::array<double, 3> spread{};  // by axis, not by place in `axes`
};

// Sorts `all` along some axis.
SpreadAxes SortAxes(const std::vector<Eigen::Vector3f>& sites,
                    const std::vector<double>& weights,
                    std::vector<uint32_t>* all) {
  SpreadAxes sorted;
  for (int a = 0; a < 3; ++a) sorted.spread[a] = Spread(sites, weights, a, all);
  std::stable_sort(sorted.axes.begin(), sorted.axes.end(), [&](int a, int b) {
    return sorted.spread[a] > sorted.spread[b];
  });
  return sorted;
}

std::vector<uint32_t> AllOf(const std::vector<Eigen::Vector3f>& sites) {
  std::vector<uint32_t> all(sites.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

// Sets the face between two boxes.
BlockBox Between(BlockBox box, int axis, const std::vector<float>& cuts, size_t k) {
  if (k > 0) box.low[axis] = cuts[k - 1];
  if (k < cuts.size()) box.high[axis] = cuts[k];
  return box;
}

// Of a view of which a block takes a smaller share, no rays are drawn.
constexpr double kLeastShare = 0.02;

// What a square of a view shows of one block.
enum class Shows : uint8_t { kNothing, kSpace, kSurface };

// A ray of a look at a view.
struct Look {
  Eigen::Vector3f direction;
  // Where the transmittance falls to 1/2; infinite where it does not.
  float distance = std::numeric_limits<float>::infinity();
  // Index of its square.
  size_t square = 0;
  // The cells that it passes.
  std::vector<uint32_t> cells;
};

// Returns kLooksAcross x kLooksAcross rays for each square of a view, as far as the camera has
// rays, traced through the foam.
std::vector<Look> LookAt(const TrainingViews& views, const ViewRenderer& renderer, int view) {
  constexpr int kStep = DrawnSquares::kSide / kLooksAcross;
  const int across = DrawnSquares::Across(views, view), down = DrawnSquares::Down(views, view);
  std::vector<Look> looks;
  for (int y = 0; y < kLooksAcross * down; ++y) {
    for (int x = 0; x < kLooksAcross * across; ++x) {
      Look look;
      if (!views.RayDirection(view,
                              std::min(x * kStep + kStep / 2, views.Width(view) - 1),
                              std::min(y * kStep + kStep / 2, views.Height(view) - 1),
                              &look.direction)) {
        continue;
      }
      look.square = static_cast<size_t>(y / kLooksAcross) * across + x / kLooksAcross;
      looks.push_back(std::move(look));
    }
  }
  const Eigen::Vector3d origin = views.Origin(view);
  const uint32_t start = renderer.StartCell(origin);
  const CellShading<float> shading = renderer.shading();
  const size_t num_sites = renderer.delaunay().num_sites;
  const auto cutoff_tau = static_cast<float>(-std::log(kTransmittanceCutoff));
  ParallelForBlocks(std::ssize(looks), kLooksAtOnce, [&](int64_t begin, int64_t end) {
    const std::span<RayTrace> traces = ThreadTraces(end - begin);
    for (int64_t i = begin; i < end; ++i) {
      RayTrace& trace = traces[i - begin];
      trace.origin = origin.cast<float>();
      trace.direction = looks[i].direction;
      trace.start_cell = start;
      trace.quantile_tau[0] = std::log(2.f);
    }
    TraceRays(renderer.geometry(), shading, cutoff_tau, traces);
    for (int64_t i = begin; i < end; ++i) {
      const RayTrace& trace = traces[i - begin];
      if (trace.composite.quantile_segment[0] >= 0) {
        looks[i].distance = trace.composite.quantile_depth[0];
      }
      for (int k = 0; k < trace.num_segments; ++k) {
        const uint32_t cell = trace.segments[k].cell;
        if (cell < num_sites) looks[i].cells.push_back(cell);
      }
    }
  });
  return looks;
}

// Returns what each square shows of a block.
std::vector<Shows> WhatSquaresShow(const std::vector<Look>& looks,
                                   size_t num_squares,
                                   const Eigen::Vector3f& origin,
                                   const BlockBox& box,
                                   float halo) {
  const BlockBox padded = box.Padded(halo);
  std::vector<Shows> squares(num_squares, Shows::kNothing);
  for (const Look& look : looks) {
    Shows& shows = squares[look.square];
    if (std::isfinite(look.distance) && padded.Contains(origin + look.distance * look.direction)) {
      shows = Shows::kSurface;
    } else if (shows == Shows::kNothing && box.IsMetBefore(origin, look.direction, look.distance)) {
      shows = Shows::kSpace;
    }
  }
  return squares;
}

// Returns whether a square or one next to it shows a surface: where a coarse foam has its edge is
// not where it is.
bool IsNearSurface(const std::vector<Shows>& squares, int across, int down, int x, int y) {
  for (int v = std::max(0, y - 1); v <= std::min(down - 1, y + 1); ++v) {
    for (int u = std::max(0, x - 1); u <= std::min(across - 1, x + 1); ++u) {
      if (squares[static_cast<size_t>(v) * across + u] == Shows::kSurface) return true;
    }
  }
  return false;
}

}  // namespace

bool BlockBox::IsMetBefore(const Eigen::Vector3f& origin,
                           const Eigen::Vector3f& direction,
                           float distance) const {
  float begin = 0, end = distance;
  for (int a = 0; a < 3; ++a) {
    if (direction[a] == 0) {
      if (origin[a] < low[a] || origin[a] >= high[a]) return false;
      continue;
    }
    float t0 = (low[a] - origin[a]) / direction[a], t1 = (high[a] - origin[a]) / direction[a];
    if (t0 > t1) std::swap(t0, t1);
    begin = std::max(begin, t0);
    end = std::min(end, t1);
  }
  return begin < end;
}

std::vector<double> ExpectedSites(const DensificationStatistics& statistics, int64_t final_sites) {
  const std::vector<float>& error = statistics.squared_error;
  std::vector<double> expected(error.size(), 1);
  const double growth = double(final_sites) - double(error.size());
  const double sum = std::accumulate(error.begin(), error.end(), 0.0);
  if (growth <= 0) return expected;
  for (size_t i = 0; i < error.size(); ++i) {
    expected[i] += growth * (sum > 0 ? error[i] / sum : 1 / double(error.size()));
  }
  return expected;
}

std::vector<BlockBox> SplitSpace(const std::vector<Eigen::Vector3f>& sites,
                                 const std::vector<double>& weights,
                                 int columns,
                                 int rows) {
  CHECK_EQ(sites.size(), weights.size());
  CHECK(columns >= 1 && rows >= 1);
  std::vector<uint32_t> all = AllOf(sites);
  const std::array<int, 3> axes = SortAxes(sites, weights, &all).axes;
  std::vector<BlockBox> boxes;
  const std::vector<float> slabs = Cuts(sites, weights, axes[0], columns, &all);
  for (int column = 0; column < columns; ++column) {
    const BlockBox slab = Between({}, axes[0], slabs, column);
    std::vector<uint32_t> inside;
    for (const uint32_t i : all) {
      if (slab.Contains(sites[i])) inside.push_back(i);
    }
    const std::vector<float> cuts = Cuts(sites, weights, axes[1], rows, &inside);
    for (int row = 0; row < rows; ++row) boxes.push_back(Between(slab, axes[1], cuts, row));
  }
  return boxes;
}

std::array<double, 2> SpreadOfSites(const std::vector<Eigen::Vector3f>& sites,
                                    const std::vector<double>& weights) {
  CHECK_EQ(sites.size(), weights.size());
  std::vector<uint32_t> all = AllOf(sites);
  const SpreadAxes sorted = SortAxes(sites, weights, &all);
  return {sorted.spread[sorted.axes[0]], sorted.spread[sorted.axes[1]]};
}

float HaloWidth(const Foam& foam,
                const std::vector<float>& radii,
                const DensificationStatistics& statistics) {
  constexpr float kSeen = 0.1f;
  constexpr float kLayers = 4;
  std::vector<float> seen;
  for (size_t i = 0; i < radii.size(); ++i) {
    if (statistics.contribution[i] > kSeen) seen.push_back(radii[i]);
  }
  // Right after a densification the statistics have seen none.
  if (seen.empty()) {
    for (size_t i = 0; i < radii.size(); ++i) {
      if (Density(foam.raw_density[i]) * radii[i] >= kSolidOpticalDepth) {
        seen.push_back(radii[i]);
      }
    }
  }
  if (seen.empty()) return 0;
  return kLayers * Median(std::move(seen));
}

std::vector<BlockRays> ChooseRays(const TrainingViews& views,
                                  const ViewRenderer& renderer,
                                  const std::vector<BlockBox>& boxes,
                                  float halo) {
  std::vector<BlockRays> chosen(boxes.size());
  for (BlockRays& rays : chosen) {
    rays.squares = DrawnSquares(views);
    rays.is_met.assign(renderer.delaunay().num_sites, 0);
  }
  int64_t num_squares = 0;
  std::vector<int64_t> num_drawn(boxes.size(), 0);
  for (int view = 0; view < views.NumViews(); ++view) {
    if (views.IsHeldOut(view)) continue;
    const int across = DrawnSquares::Across(views, view), down = DrawnSquares::Down(views, view);
    const size_t size = static_cast<size_t>(across) * down;
    num_squares += static_cast<int64_t>(size);
    const std::vector<Look> looks = LookAt(views, renderer, view);
    const Eigen::Vector3f origin = views.Origin(view).cast<float>();
    for (size_t b = 0; b < boxes.size(); ++b) {
      const std::vector<Shows> squares = WhatSquaresShow(looks, size, origin, boxes[b], halo);
      const auto on_surface = std::count(squares.begin(), squares.end(), Shows::kSurface);
      if (double(on_surface) < kLeastShare * double(size) || on_surface == 0) continue;
      BlockRays& rays = chosen[b];
      rays.views.push_back(view);
      std::vector<uint8_t> is_drawn(size, 0);
      for (int y = 0; y < down; ++y) {
        for (int x = 0; x < across; ++x) {
          const size_t at = static_cast<size_t>(y) * across + x;
          if (squares[at] == Shows::kNothing) continue;
          const bool passes = CounterRandom(view, kPassingPurpose, at).Below(kPassingSquares) == 0;
          if (!passes && !IsNearSurface(squares, across, down, x, y)) continue;
          is_drawn[at] = 1;
          rays.squares.Add(view, x, y);
          ++num_drawn[b];
        }
      }
      for (const Look& look : looks) {
        if (!is_drawn[look.square]) continue;
        for (const uint32_t cell : look.cells) rays.is_met[cell] = 1;
      }
    }
  }
  for (size_t b = 0; b < boxes.size(); ++b) {
    chosen[b].share = num_squares > 0 ? double(num_drawn[b]) / double(num_squares) : 0;
  }
  return chosen;
}

}  // namespace semfoam
