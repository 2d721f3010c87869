// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/device/cuda/segment_pool.h"
#include "foam/geometry/guard_sites.h"
#include "foam/model/activation.h"
#include "foam/optim/optimizer.h"
#include "foam/render/color_variation.h"
#include "foam/render/ray_batch.h"
#include "foam/render/total_variation.h"
#include "foam/render/update_loops.h"
#include "foam/render/walk.h"
#include "foam/util/host_device.h"

#include <cmath>
#include <cstdint>

// FoamOptimizer::Step, the variations and Refresh as kernels. Each kernel documents what one thread
// does. All arrays are the GPU's.

namespace semfoam {

// Number of threads that share a cell's row of parameters. Thread t has parameters t, t +
// kRowThreads, ..., so that neighbouring threads access neighbouring floats.
inline constexpr int kRowThreads = 32;
inline constexpr int kMaxPerRowThread = (ParameterRow::kMaxSize + kRowThreads - 1) / kRowThreads;

// The Voronoi graph, with the weights of TotalVariationWeights.
struct VariationGraph {
  const uint32_t* offsets = nullptr;  // null: no total variation in this step
  const uint32_t* neighbors = nullptr;
  const float* weights = nullptr;
  float scale = 0;
};

// Collects what ColorGraph compares of a cell. Thread: site.
struct CollectSurfaceColor {
  const Eigen::Vector3f* positions;
  const float* density;
  const StepLengths* step_lengths;
  const float* sh;
  int sh_stride;
  const float* color_gradient;  // null: none
  float* rows;                  // [num_sites][kSurfaceColorDim]

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const {
    WriteSurfaceColor(positions[i],
                      CellOpacity(density[i], step_lengths[i].position),
                      sh + i * sh_stride,
                      color_gradient != nullptr ? color_gradient + i * kColorGradientDim : nullptr,
                      rows + i * kSurfaceColorDim);
  }
};

// The contributions of each cell, sorted by cell and in the order of the rays.
struct CellContributions {
  const Slot* slots;      // the pool's
  const uint32_t* order;  // slots, sorted by cell
  const uint32_t* begin;  // [num_sites] of the cell in `order`
  const uint32_t* end;    // likewise
  const RayOutput* rays;
};

// The colour gradients of the cells, around the positions that the rays met; null: none.
struct CellGradients {
  const Eigen::Vector3f* sites;
  const float* color_gradient;  // [num_sites][kColorGradientDim]
};

// Computes the gradient of a cell's row of parameters: SumRecords, the derivative of the density's
// activation, and the variations. Threads: kRowThreads per site.
struct SumCellGradient {
  CellContributions contributions;
  CellGradients cells;
  ParameterRow row;
  VariationGraph graph;
  ColorGraph color_graph;
  uint32_t num_sites;
  const float* raw_density;
  const float* identity;

  float* gradients;      // [num_sites][row.size]
  uint8_t* not_finite;   // [num_sites] zero before
  float* squared_error;  // [num_sites] of DensificationStatistics
  float* contribution;   // likewise

  SEMFOAM_HOST_DEVICE void operator()(int64_t t) const {
    const uint32_t cell = static_cast<uint32_t>(t / kRowThreads);
    const int thread = static_cast<int>(t % kRowThreads);
    const uint32_t begin = contributions.begin[cell], end = contributions.end[cell];
    if (begin == end && graph.offsets == nullptr) return;
    float sum[kMaxPerRowThread] = {};
    float largest_weight = 0, errors = 0;
    for (uint32_t k = begin; k < end; ++k) {
      const Slot& slot = contributions.slots[contributions.order[k]];
      const CellContribution<float> c = ContributionIn(slot);
      const RayOutput& ray = contributions.rays[RayOf(slot)];
      const float* const shared = ray.parameters;
      const bool counts = c.weight > kNegligibleWeight;
      for (int m = 0; m < kMaxPerRowThread; ++m) {
        const int p = thread + m * kRowThreads;
        if (p >= row.size) break;
        if (p < row.position) {
          if (counts) sum[m] += c.weight * shared[p];
        } else if (p < row.density) {
          sum[m] += c.position[p - row.position];
          if (row.HasColorGradient() && counts) {
            sum[m] -= ByOffset(cell, p - row.position, c, shared);
          }
        } else if (p == row.density) {
          sum[m] += c.density;
        } else if (p < row.sh) {
          if (counts) sum[m] += ByColorGradient(cell, p - row.color_gradient, c, ray);
        } else if (c.weight != 0 && (counts || p < row.sh + 3) &&
                   (c.color_mask >> ((p - row.sh) % 3) & 1)) {
          sum[m] += c.weight * shared[p];
        }
      }
      if (thread == 0 && c.weight != 0) {
        const float* const by_color = shared + row.sh;
        errors += c.weight * (by_color[0] * by_color[0] + by_color[1] * by_color[1] +
                              by_color[2] * by_color[2]);
        largest_weight = c.weight > largest_weight ? c.weight : largest_weight;
      }
    }
    for (int m = 0; m < kMaxPerRowThread; ++m) {
      const int p = thread + m * kRowThreads;
      if (p >= row.size) break;
      if (p == row.density) sum[m] *= DensityDerivative(raw_density[cell]);
      if (p < row.position && graph.offsets != nullptr) sum[m] += Variation(cell, p);
      if (p >= row.color_gradient && p < row.sh + 3 && begin != end &&
          color_graph.offsets != nullptr) {
        const int index = p < row.sh ? p - row.color_gradient : kColorGradientDim + p - row.sh;
        sum[m] += ColorVariation(cell, index);
      }
      if (!(sum[m] * sum[m] < std::numeric_limits<float>::infinity())) Raise(&not_finite[cell]);
      gradients[int64_t{cell} * row.size + p] = sum[m];
    }
    // FinishCell adds these to the statistics if the gradient is finite.
    if (thread == 0) {
      squared_error[cell] = errors;
      contribution[cell] = largest_weight;
    }
  }

 private:
  // Returns dL/dcolour of a channel.
  SEMFOAM_HOST_DEVICE float ByColor(const CellContribution<float>& c,
                                    const float* shared,
                                    int channel) const {
    constexpr float kUnit = static_cast<float>(1 / kShDc);
    return c.color_mask >> channel & 1 ? kUnit * c.weight * shared[row.sh + channel] : 0.f;
  }
  // Returns the derivative by the offset of a segment's centroid from the site along an axis.
  SEMFOAM_HOST_DEVICE float ByOffset(uint32_t cell,
                                     int axis,
                                     const CellContribution<float>& c,
                                     const float* shared) const {
    const float* const gradient =
        cells.color_gradient + int64_t{cell} * kColorGradientDim + 3 * axis;
    float sum = 0;
    for (int i = 0; i < 3; ++i) sum += ByColor(c, shared, i) * gradient[i];
    return sum;
  }
  // Returns the derivative by a value of the colour gradient.
  SEMFOAM_HOST_DEVICE float ByColorGradient(uint32_t cell,
                                            int index,
                                            const CellContribution<float>& c,
                                            const RayOutput& ray) const {
    const int axis = index / 3;
    const float offset =
        ray.origin[axis] + c.centroid * ray.direction[axis] - cells.sites[cell][axis];
    return ByColor(c, ray.parameters, index % 3) * offset;
  }
  // Returns the derivative of the total variation by a channel of a cell's identity.
  SEMFOAM_HOST_DEVICE float Variation(uint32_t cell, int channel) const {
    const float own = identity[int64_t{cell} * kIdentityDim + channel];
    float sum = 0;
    for (uint32_t e = graph.offsets[cell]; e < graph.offsets[cell + 1]; ++e) {
      const uint32_t j = graph.neighbors[e];
      if (j >= num_sites) continue;
      const float other = identity[int64_t{j} * kIdentityDim + channel];
      sum += graph.weights[e] * (float(own > other) - float(own < other));
    }
    return graph.scale * sum;
  }
  // Returns the derivative of the colours' variation by one of the cell's parameters.
  SEMFOAM_HOST_DEVICE float ColorVariation(uint32_t cell, int index) const {
    const float* const own = color_graph.rows + int64_t{cell} * kSurfaceColorDim;
    float sum[kColorVariationDim] = {};
    for (uint32_t e = color_graph.offsets[cell]; e < color_graph.offsets[cell + 1]; ++e) {
      const uint32_t j = color_graph.neighbors[e];
      if (j >= num_sites) continue;
      AddColorSlopes(
          color_graph.weights[e], own, color_graph.rows + int64_t{j} * kSurfaceColorDim, sum);
    }
    return color_graph.scale * sum[index];
  }
};

// Computes a cell's share of the total variation; each edge is counted from both its sides. Thread:
// site.
struct MeasureVariation {
  VariationGraph graph;
  uint32_t num_sites;
  const float* identity;
  float* variation;  // [num_sites]

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const {
    float sum = 0;
    for (uint32_t e = graph.offsets[i]; e < graph.offsets[i + 1]; ++e) {
      const uint32_t j = graph.neighbors[e];
      if (j >= num_sites) continue;
      sum += EdgeVariation(
          graph.weights[e], identity + i * kIdentityDim, identity + int64_t{j} * kIdentityDim);
    }
    variation[i] = sum;
  }
};

// Computes the sums of kValuesPerSum values, in their order. Thread: sum.
inline constexpr int64_t kValuesPerSum = 1024;
template <typename T>
struct SumValues {
  const T* values;
  int64_t count;
  double* sums;

  SEMFOAM_HOST_DEVICE void operator()(int64_t k) const {
    const int64_t end = count < (k + 1) * kValuesPerSum ? count : (k + 1) * kValuesPerSum;
    double sum = 0;
    for (int64_t i = k * kValuesPerSum; i < end; ++i) sum += values[i];
    sums[k] = sum;
  }
};

// Learning rates of the parameters of a row.
struct RowRates {
  float identity, position, density, color_gradient, sh_dc, sh_rest;

  SEMFOAM_HOST_DEVICE float Of(const ParameterRow& row, int p) const {
    if (p < row.position) return identity;
    if (p < row.density) return position;
    if (p == row.density) return density;
    if (p < row.sh) return color_gradient;
    return p < row.sh + 3 ? sh_dc : sh_rest;
  }
};

// Takes AdamStep of a cell's row. Updates SH and identity; the changes of the parameters between
// them replace their gradients, for FinishCell. Threads: kRowThreads per site.
struct AdamStepOfCell {
  ParameterRow row;
  RowRates rates;
  int sh_stride;
  bool has_variation;
  const uint32_t* begin;  // as in CellContributions
  const uint32_t* end;
  const uint8_t* not_finite;
  const float* contribution;          // largest weight of a contribution to the cell
  const AdamCorrection* corrections;  // [num_corrections] by step; the last holds from there on
  uint32_t num_corrections;
  const uint32_t* steps;

  float* gradients;
  float* first_moments;  // [num_sites][row.size]
  float* second_moments;
  float* sh;
  float* identity;

  SEMFOAM_HOST_DEVICE void operator()(int64_t t) const {
    const int64_t cell = t / kRowThreads;
    const bool has_contributions = begin[cell] != end[cell];
    if ((!has_contributions && !has_variation) || not_finite[cell]) return;
    const ParameterSpan stepped =
        ParametersToStep(row, has_contributions, contribution[cell], has_variation);
    const uint32_t step = steps[cell] < num_corrections ? steps[cell] : num_corrections - 1;
    for (int p = static_cast<int>(t % kRowThreads); p < stepped.end; p += kRowThreads) {
      if (p < stepped.begin) continue;
      const int64_t at = cell * row.size + p;
      const float g = gradients[at];
      const float m = first_moments[at] = kAdamBeta1 * first_moments[at] + (1 - kAdamBeta1) * g;
      const float v = second_moments[at] =
          kAdamBeta2 * second_moments[at] + (1 - kAdamBeta2) * (g * g);
      const float change = rates.Of(row, p) * (m * -corrections[step].first) /
                           (std::sqrt(v * corrections[step].second) + kAdamEpsilon);
      if (p < row.position) {
        identity[cell * kIdentityDim + p] += change;
      } else if (p < row.sh) {
        gradients[at] = change;
      } else if (p < row.sh + sh_stride) {
        sh[cell * sh_stride + p - row.sh] += change;
      }
    }
  }
};

// Finishes the step: updates position, density, colour gradient, count of steps and statistics.
// Thread: site.
struct FinishCell {
  ParameterRow row;
  bool has_variation;
  const uint32_t* begin;
  const uint32_t* end;
  const uint8_t* not_finite;
  const float* changes;  // AdamStepOfCell's gradients
  const StepLengths* step_lengths;
  const uint8_t* is_clear;
  const float* squared_error;  // of this step
  const float* contribution;

  uint32_t* steps;
  Eigen::Vector3f* positions;
  float* raw_density;
  float* density;
  float* color_gradient;     // null: none
  float* squared_error_sum;  // DensificationStatistics
  float* largest_contribution;

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const {
    const bool has_contributions = begin[i] != end[i];
    if ((!has_contributions && !has_variation) || not_finite[i]) return;
    ++steps[i];
    if (!has_contributions) return;
    squared_error_sum[i] += squared_error[i];
    if (contribution[i] > largest_contribution[i]) largest_contribution[i] = contribution[i];
    const float* const change = changes + i * row.size;
    Eigen::Vector3f position = positions[i];
    for (int a = 0; a < 3; ++a) position[a] += step_lengths[i].position * change[row.position + a];
    const float distance = position.norm();
    if (distance > kFarRadius) position *= kFarRadius / distance;
    positions[i] = position;
    if (row.HasColorGradient()) {
      StepColorGradient(change + row.color_gradient,
                        step_lengths[i].color_gradient,
                        color_gradient + i * kColorGradientDim);
    }
    if (is_clear[i]) return;
    const float raw = raw_density[i] + change[row.density];
    raw_density[i] = raw > kLowestRawDensity ? raw : kLowestRawDensity;
    density[i] = Density(raw_density[i]);
  }
};

// Copies a site's position to the positions of the planes. Thread: site.
struct CopySite {
  const Eigen::Vector3f* positions;
  Eigen::Vector3f* plane_positions;

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const { plane_positions[i] = positions[i]; }
};

// Recomputes one lane of a block of planes, as PlanesFromSites does. Thread: block and lane.
struct RefreshPlane {
  const Eigen::Vector3f* positions;
  const uint32_t* cell_of_block;
  PlaneBlock<float>* blocks;
  // [num_cells] Zero before; set where a site nearly coincides with a neighbour.
  uint8_t* has_twin;
  // One flag, zero before.
  uint8_t* any_twin;

  SEMFOAM_HOST_DEVICE void operator()(int64_t t) const {
    PlaneBlock<float>& block = blocks[t / kPlaneLanes];
    const int lane = static_cast<int>(t % kPlaneLanes);
    const uint32_t cell = cell_of_block[t / kPlaneLanes];
    const uint32_t j = block.neighbor[lane];
    const Eigen::Vector3f site = positions[cell];
    const Eigen::Vector3f n = positions[j != kNoCell ? j : cell] - site;
    const float squared = j != kNoCell ? n[0] * n[0] + n[1] * n[1] + n[2] * n[2] : 2.f;
    block.normal_x[lane] = n[0];
    block.normal_y[lane] = n[1];
    block.normal_z[lane] = n[2];
    block.half_squared[lane] = 0.5f * squared;
    if (IsHardlyApart(squared, site)) {
      Raise(&has_twin[cell]);
      Raise(any_twin);
    }
  }
};

// Marks cells with near-duplicates, and their neighbours, for the walk in double precision. Thread:
// block.
struct LeaveNearDuplicatesToDouble {
  const uint32_t* first_block;
  const uint32_t* cell_of_block;
  const uint8_t* has_twin;
  const uint8_t* any_twin;
  PlaneBlock<float>* blocks;

  SEMFOAM_HOST_DEVICE void operator()(int64_t b) const {
    if (!*any_twin) return;
    const uint32_t cell = cell_of_block[b];
    bool in_double = has_twin[cell] != 0;
    for (uint32_t k = first_block[cell]; k < first_block[cell + 1] && !in_double; ++k) {
      for (const uint32_t j : blocks[k].neighbor) {
        in_double = in_double || (j != kNoCell && has_twin[j] != 0);
      }
    }
    if (!in_double) return;
    PlaneBlock<float>& block = blocks[b];
    for (uint32_t lane = 0; lane < kPlaneLanes; ++lane) {
      block.normal_x[lane] = block.normal_y[lane] = block.normal_z[lane] = 0;
      block.half_squared[lane] = 0;
    }
  }
};

// Finds the cell around an origin, from a cell near it (NearestCell). Thread: origin.
struct FindStartCell {
  WalkView<float> geometry;
  const Eigen::Vector3d* origins;
  uint32_t* cells;

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const {
    cells[i] = NearestCell(geometry, origins[i], cells[i]);
  }
};

}  // namespace semfoam
