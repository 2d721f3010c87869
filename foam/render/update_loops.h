// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/render/color_variation.h"
#include "foam/render/ray_batch.h"

#include <cstdint>
#include <span>

// The inner loops of the optimiser and the regulariser, with vector instructions chosen when the
// program runs (see ray_tracer.h).

namespace semfoam {

inline constexpr float kAdamBeta1 = 0.9f;
// Adam's beta2. Lower than the usual 0.999, because a cell receives hundreds of gradients in a run,
// not tens of thousands.
inline constexpr float kAdamBeta2 = 0.99f;
inline constexpr float kAdamEpsilon = 1e-15f;

// 1 / (1 - beta^t) of both moments.
struct AdamCorrection {
  float first = 1, second = 1;
};

// Takes one Adam step (Kingma and Ba 2015, algorithm 1) of `count` parameters: updates both moments
// and writes the changes of the parameters to `change`. All arrays are [count]. If the gradient is
// not finite, does nothing and returns false.
bool AdamStep(const AdamCorrection& correction,
              int count,
              const float* gradient,
              const float* rate,
              float* first_moment,
              float* second_moment,
              float* change);

// Adds change[k] to parameters[k].
void AddTo(const float* change, int count, float* parameters);

// Statistics of a cell over its records.
struct RecordTotals {
  float largest_weight = 0;
  float squared_error = 0;  // sum of weight times |dL/dcolour|^2 of the ray
};

// Adds the records of one cell to `gradient` [row.size], in their order: dL/dsigma goes to
// row.density. `rays` are the batch's, `site` the position that they met. `color_gradient` is the
// cell's, or null where `row` has none.
RecordTotals SumRecords(std::span<const GradientRecord> records,
                        const RayOutput* rays,
                        const ParameterRow& row,
                        const Eigen::Vector3f& site,
                        const float* color_gradient,
                        float* gradient);

// Computes TotalVariation (total_variation.h) of the edges of cells [begin, end), each edge from
// both its sides: writes `scale` dL/df to `gradient` [.][kIdentityDim], returns the sum of a_ij
// |f_i - f_j|. `offsets` and `neighbors` are the triangulation's, `weights` aligned with the
// latter.
double TotalVariationOfCells(const uint32_t* offsets,
                             const uint32_t* neighbors,
                             const float* weights,
                             uint32_t num_sites,
                             const float* identity,
                             float scale,
                             uint32_t begin,
                             uint32_t end,
                             float* gradient);

// Adds the derivatives of the colours' variation (color_variation.h) by the parameters of a cell,
// over all its edges and times graph.scale, to `gradient` [kColorVariationDim].
void AddColorVariation(const ColorGraph& graph, uint32_t cell, float* gradient);

// Computes the planes of cells [begin, end), from all cells' positions: fills all rows of `blocks`
// (those of cell i: first_block[i], ...) but the neighbours, which are read, and writes the squared
// distance from each of these cells to its nearest neighbour to `nearest_squared` [end - begin]
// (infinity for a cell without neighbours, 2 at most for one with empty lanes). No fused
// multiply-add, so that the planes are the same on every instruction set.
void PlanesFromSites(const Eigen::Vector3f* positions,
                     const uint32_t* first_block,
                     int64_t begin,
                     int64_t end,
                     PlaneBlock<float>* blocks,
                     float* nearest_squared);

}  // namespace semfoam
