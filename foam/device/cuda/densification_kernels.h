// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/activation.h"
#include "foam/optim/densification.h"
#include "foam/optim/optimizer.h"
#include "foam/util/host_device.h"

#include <cstdint>

// Rearrange, FoamOptimizer::Rearrange and TrainingDevice::HoldDensities as kernels: what one thread
// of each does. All arrays are the GPU's; new arrays are others than the old ones.

namespace semfoam {

// What rays do not see becomes transparent, before a densification. Thread: old site.
struct FadeUnseen {
  const float* contribution;  // DensificationStatistics
  float transparent_contribution;
  float* raw_density;

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const {
    raw_density[i] = FadedRawDensity(raw_density[i], contribution[i], transparent_contribution);
  }
};

// Where the sites are: old ones stay where they are now. Thread: new site.
struct PlaceSites {
  const uint32_t* origin;  // Rearrangement
  const uint8_t* is_new;
  const Eigen::Vector3f* planned;  // [new N]
  const Eigen::Vector3f* old_positions;
  Eigen::Vector3f* positions;

  SEMFOAM_HOST_DEVICE void operator()(int64_t k) const {
    positions[k] = is_new[k] ? planned[k] : old_positions[origin[k]];
  }
};

// New row k is old row origin[k], or zeros where that is asked for. Thread: value of the result.
template <typename T>
struct GatherRows {
  const uint32_t* origin;
  const uint8_t* is_zero;  // [new N], or null: none is
  int stride;              // of a row
  const T* old_values;
  T* values;

  SEMFOAM_HOST_DEVICE void operator()(int64_t t) const {
    const int64_t k = t / stride;
    const bool zero = is_zero != nullptr && is_zero[k];
    values[t] = zero ? T(0) : old_values[int64_t{origin[k]} * stride + t % stride];
  }
};

// Thread: site.
struct HoldDensity {
  const uint8_t* is_clear;
  float* raw_density;

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const {
    raw_density[i] = HeldRawDensity(raw_density[i], is_clear[i] != 0);
  }
};

// CellDensities, but for the guards'. Thread: site.
struct ActivateDensity {
  const float* raw_density;
  float* density;

  SEMFOAM_HOST_DEVICE void operator()(int64_t i) const { density[i] = Density(raw_density[i]); }
};

}  // namespace semfoam
