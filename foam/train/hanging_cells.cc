// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/train/hanging_cells.h"

#include "foam/geometry/voronoi.h"
#include "foam/render/cell_shading.h"
#include "foam/render/ray_caster.h"
#include "foam/render/ray_tracer.h"
#include "foam/util/parallel.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

namespace semfoam {
namespace {

// How many large cells on a ray, one behind the other, are looked through.
constexpr int kMostLookedThrough = 12;
// The change of one ray's colour counts up to this: an edge behind the cell is no judge.
constexpr float kLargestChange = 0.2f;
// A camera whose photo has fewer rays that show cells that are not large has no median distance.
constexpr size_t kFewestDistances = 20;

// What a ray says of the large cell that it shows.
struct Judgement {
  uint32_t cell;
  // Where the ray enters it.
  float distance;
  // Squared change of the ray's colour without the cell, summed over the channels.
  float change;
  // The cell that the ray would show behind a gap; kNoCell where there is none.
  uint32_t behind_gap;
  // Whether the cell begins near before the ray's camera.
  bool is_near = false;
};

// What the rays of a row or of a photo say.
struct Judgements {
  std::vector<Judgement> of_large_cells;
  // The cells that the rays show.
  std::vector<uint32_t> shown;
  // The distances of those that are not large.
  std::vector<float> distances;
};

// Sums of the judgements of a cell.
struct Verdict {
  double change = 0;
  int num_rays = 0;
  // Of rays from near.
  int num_near_rays = 0;
  int num_near_gaps = 0;

  bool IsHarmlessToClear() const {
    return change <= 3 * kHarmlessChange * kHarmlessChange * num_rays;
  }
  bool StandsFree() const {
    return num_near_rays >= kFewestJudgingRays && num_near_gaps >= kLeastGapShare * num_near_rays;
  }
};

// Number of photos that show a cell, and that show it from near.
struct Witnesses {
  int all = 0;
  int near = 0;
};

struct Scene {
  const WalkGeometry<float>& geometry;
  CellShading<float> shading;
  uint32_t num_sites;
  std::vector<float> radii;

  void Trace(std::span<RayTrace> traces) const {
    TraceRays(geometry, shading, static_cast<float>(-std::log(kTransmittanceCutoff)), traces);
  }
  bool IsLarge(uint32_t cell, float distance) const {
    return radii[cell] > kLargeRadius * distance;
  }
};

Eigen::Vector3f OverWhite(const RayTrace& trace) {
  const float* const color = trace.composite.color;
  return Eigen::Vector3f(color[0], color[1], color[2]).array() + trace.composite.Transmittance();
}

float EntryDistance(const RayTrace& trace, int segment) {
  return segment > 0 ? trace.segments[segment - 1].t_out : 0;
}

// Returns the segment with more than half of the weight; nothing where there is none.
std::optional<int> ShownSegment(const RayTrace& trace) {
  for (int k = 0; k < trace.num_segments; ++k) {
    if (trace.weight[k] > 0.5f) return k;
  }
  return {};
}

// Returns the segment in which the transmittance falls to one half; nothing where it does not.
std::optional<int> MedianSegment(const RayTrace& trace) {
  for (int k = 0; k < trace.num_segments; ++k) {
    if (trace.transmittance[k] < 0.5f) return k;
  }
  return {};
}

// What a ray meets behind some cells.
struct Background {
  // Over white.
  Eigen::Vector3f color = Eigen::Vector3f::Ones();
  // The cell in which the transmittance falls to one half, and its distance from the camera;
  // kNoCell where it does not.
  uint32_t cell = kNoCell;
  float distance = 0;
};

// Casts the ray from `distance` on, where it enters `cell`, past all large cells that it shows one
// directly after the other.
Background LookBehind(const Scene& scene,
                      const Eigen::Vector3f& origin,
                      const Eigen::Vector3f& direction,
                      float distance,
                      uint32_t cell) {
  Background result;
  const std::span<RayTrace> traces = ThreadTraces(1);
  RayTrace& trace = traces[0];
  for (int looked_through = 0; cell < scene.num_sites; ++looked_through) {
    trace.origin = origin + distance * direction;
    trace.direction = direction;
    trace.start_cell = cell;
    scene.Trace(traces);
    const bool shows_cell = trace.num_segments > 0 && trace.weight[0] > 0.5f;
    if (shows_cell && looked_through < kMostLookedThrough && scene.IsLarge(cell, distance)) {
      distance += trace.segments[0].t_out;
      cell = trace.segments[1].cell;
      continue;
    }
    result.color = OverWhite(trace);
    if (const auto k = MedianSegment(trace)) {
      result.cell = trace.segments[*k].cell;
      result.distance = distance + EntryDistance(trace, *k);
    }
    break;
  }
  return result;
}

// Judges by one ray of a photo.
void Judge(const Scene& scene, const RayTrace& trace, Judgements* judgements) {
  const std::optional<int> shown = ShownSegment(trace);
  if (!shown || trace.segments[*shown].cell >= scene.num_sites) return;
  const RayTrace::Segment& segment = trace.segments[*shown];
  const uint32_t cell = segment.cell;
  const float entry = EntryDistance(trace, *shown);
  judgements->shown.push_back(cell);
  if (!scene.IsLarge(cell, entry)) {
    judgements->distances.push_back(entry);
    return;
  }
  Eigen::Vector3f without = Eigen::Vector3f::Zero();
  for (int k = 0; k < *shown; ++k) {
    for (int c = 0; c < 3; ++c) without[c] += trace.weight[k] * trace.color[c][k];
  }
  const Background background = LookBehind(
      scene, trace.origin, trace.direction, segment.t_out, trace.segments[*shown + 1].cell);
  without += std::exp(-segment.tau_in) * background.color;
  const bool has_gap =
      background.cell < scene.num_sites && background.distance > segment.t_out + scene.radii[cell];
  judgements->of_large_cells.push_back(
      {cell,
       entry,
       std::min((without - OverWhite(trace)).squaredNorm(), kLargestChange),
       has_gap ? background.cell : kNoCell});
}

// Judges by the rays of a grid in one photo, row by row.
Judgements JudgeByPhoto(const Scene& scene,
                        const TrainingViews& views,
                        int view,
                        uint32_t start_cell) {
  const int width = views.Width(view), height = views.Height(view);
  const int stride = std::max(1, std::max(width, height) / kJudgingRaysAlongSide);
  std::vector<Judgements> rows((height + stride - 1) / stride);
  ParallelForBlocks(std::ssize(rows), 1, [&](int64_t row, int64_t) {
    const int y = static_cast<int>(row) * stride;
    std::vector<RayTrace> traces;
    for (int x = 0; x < width; x += stride) {
      Eigen::Vector3f direction;
      if (!views.RayDirection(view, x, y, &direction)) continue;
      RayTrace& trace = traces.emplace_back();
      trace.origin = views.Origin(view).cast<float>();
      trace.direction = direction;
      trace.start_cell = start_cell;
    }
    scene.Trace(traces);
    for (const RayTrace& trace : traces) Judge(scene, trace, &rows[row]);
  });
  Judgements result;
  const auto append = [](const auto& from, auto* to) {
    to->insert(to->end(), from.begin(), from.end());
  };
  for (const Judgements& row : rows) {
    append(row.of_large_cells, &result.of_large_cells);
    append(row.shown, &result.shown);
    append(row.distances, &result.distances);
  }
  return result;
}

// Returns how near to the camera of a photo cells are near; 0 where the photo does not tell how far
// things are.
float NearDistance(std::vector<float> distances) {
  if (distances.size() < kFewestDistances) return 0;
  const auto median = distances.begin() + distances.size() / 2;
  std::nth_element(distances.begin(), median, distances.end());
  return kNearShare * *median;
}

void SortUnique(std::vector<uint32_t>* cells) {
  std::sort(cells->begin(), cells->end());
  cells->erase(std::unique(cells->begin(), cells->end()), cells->end());
}

// Returns the views by which cells are judged.
std::vector<int> JudgingViews(const TrainingViews& views) {
  std::vector<int> training;
  for (int view = 0; view < views.NumViews(); ++view) {
    if (!views.IsHeldOut(view)) training.push_back(view);
  }
  const size_t count = std::min<size_t>(training.size(), kMostJudgingViews);
  std::vector<int> result;
  for (size_t k = 0; k < count; ++k) result.push_back(training[k * training.size() / count]);
  return result;
}

}  // namespace

std::vector<uint32_t> FindHangingCells(const Foam& foam,
                                       const TrainingTopology& topology,
                                       const TrainingViews& views) {
  const std::vector<float> density = CellDensities(foam);
  const auto num_sites = static_cast<uint32_t>(foam.NumSites());
  const Scene scene{topology.geometry(),
                    ShadingOf(foam, density),
                    num_sites,
                    CellRadii(topology.geometry().positions, topology.delaunay())};
  std::vector<Judgement> judgements;
  std::vector<Witnesses> witnesses(num_sites);
  uint32_t start_cell = num_sites;
  for (const int view : JudgingViews(views)) {
    start_cell = topology.CellAt(views.Origin(view), start_cell);
    Judgements by_photo = JudgeByPhoto(scene, views, view, start_cell);
    const float near_distance = NearDistance(std::move(by_photo.distances));
    std::vector<uint32_t> shown_near;
    for (Judgement& judgement : by_photo.of_large_cells) {
      judgement.is_near = judgement.distance < near_distance;
      if (judgement.is_near) shown_near.push_back(judgement.cell);
      judgements.push_back(judgement);
    }
    SortUnique(&by_photo.shown);
    SortUnique(&shown_near);
    for (const uint32_t cell : by_photo.shown) ++witnesses[cell].all;
    for (const uint32_t cell : shown_near) ++witnesses[cell].near;
  }
  std::vector<Verdict> verdicts(num_sites);
  for (const Judgement& judgement : judgements) {
    Verdict& verdict = verdicts[judgement.cell];
    verdict.change += judgement.change;
    ++verdict.num_rays;
    if (!judgement.is_near) continue;
    ++verdict.num_near_rays;
    verdict.num_near_gaps +=
        judgement.behind_gap != kNoCell && witnesses[judgement.behind_gap].all >= kFewestWitnesses;
  }
  std::vector<uint32_t> hanging;
  for (uint32_t i = 0; i < num_sites; ++i) {
    if (witnesses[i].near < kFewestWitnesses && verdicts[i].StandsFree() &&
        verdicts[i].IsHarmlessToClear()) {
      hanging.push_back(i);
    }
  }
  return hanging;
}

}  // namespace semfoam
