// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/activation.h"
#include "foam/model/spherical_harmonics.h"
#include "foam/optim/densification.h"
#include "foam/optim/optimizer.h"
#include "foam/util/host_device.h"

#include <cstdint>

// Rearrange, FoamOptimizer::Rearrange and TrainingDevice::ClampDensities as kernels. Each
// kernel documents what one thread does. All arrays are the GPU's; results never overlap inputs.

namespace semfoam {

// Makes cells that no ray sees transparent, before a densification. Thread: old site.
struct FadeUnseen {
  // DensificationStatistics::contribution.
  const float* contribution;
  float transparent_contribution;
  const Eigen::Vector3f* positions;
  float* raw_density;

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const {
    raw_density[i] =
        FadedRawDensity(raw_density[i], positions[i], contribution[i], transparent_contribution);
  }
};

// Moves a child from its parent's place to its own, and its colour with it. Thread: new site.
struct PlaceSite {
  // Rearrangement::is_new.
  const uint8_t* is_new;
  // [new N] Rearrangement::positions.
  const Eigen::Vector3f* planned;
  // [new N][kColorGradientDim]; null: none.
  const float* color_gradient;
  int sh_stride;
  Eigen::Vector3f* positions;
  float* sh;

  SEMFOAM_HOST_DEVICE void operator()(int64_t k) const {
    if (!is_new[k]) return;
    if (color_gradient != nullptr) {
      ShiftColor(
          planned[k] - positions[k], color_gradient + k * kColorGradientDim, sh + k * sh_stride);
    }
    positions[k] = planned[k];
  }
};

// Copies old row origin[k] to new row k, or writes zeros where is_zero[k]. Thread: value of the
// result.
template <typename T>
struct GatherRows {
  const uint32_t* origin;
  // [new N]; null: no row is zero.
  const uint8_t* is_zero;
  // Length of a row.
  int stride;
  const T* old_values;
  T* values;

  SEMFOAM_HOST_DEVICE void operator()(int64_t t) const {
    const int64_t k = t / stride;
    const bool zero = is_zero != nullptr && is_zero[k];
    values[t] = zero ? T(0) : old_values[int64_t{origin[k]} * stride + t % stride];
  }
};

// Thread: site.
// Applies ClampedRawDensity. Thread: site.
struct ClampDensity {
  const uint8_t* is_clear;
  float* raw_density;

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const {
    raw_density[i] = ClampedRawDensity(raw_density[i], is_clear[i] != 0);
  }
};

// Computes CellDensities of the sites; those of the guards are not written. Thread: site.
struct ActivateDensity {
  const float* raw_density;
  float* density;

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const { density[i] = Density(raw_density[i]); }
};

}  // namespace semfoam
