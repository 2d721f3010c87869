// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/trainer.h"

#include <cstdint>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace semfoam {

template <typename Vector>
uint64_t Digest(const Vector& values, uint64_t seed) {
  return XXH64(values.data(), values.size() * sizeof(values[0]), seed);
}

// All that training gives.
inline uint64_t Digest(const TrainingSummary& summary) {
  const Foam& foam = summary.foam;
  uint64_t hash = Digest(foam.positions, 0);
  hash = Digest(foam.raw_density, hash);
  hash = Digest(foam.sh, hash);
  hash = Digest(foam.identity, hash);
  hash = Digest(foam.classifier_weight, hash);
  hash = Digest(foam.classifier_bias, hash);
  hash = Digest(summary.statistics.contribution, hash);
  hash = Digest(summary.statistics.passed, hash);
  hash = Digest(summary.statistics.stopped, hash);
  return Digest(summary.statistics.mean_color, hash);
}

}  // namespace semfoam
