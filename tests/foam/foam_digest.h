// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/train/trainer.h"

#include <cstdint>

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace semfoam {

template <typename Vector>
uint64_t DigestOf(const Vector& values, uint64_t seed) {
  return XXH64(values.data(), values.size() * sizeof(values[0]), seed);
}

// A number for all that training has made, which is another one where a single bit is.
inline uint64_t DigestOf(const TrainingSummary& summary) {
  const Foam& foam = summary.foam;
  uint64_t hash = DigestOf(foam.positions, 0);
  hash = DigestOf(foam.raw_density, hash);
  hash = DigestOf(foam.sh, hash);
  hash = DigestOf(foam.identity, hash);
  hash = DigestOf(foam.classifier_weight, hash);
  hash = DigestOf(foam.classifier_bias, hash);
  hash = DigestOf(summary.statistics.contribution, hash);
  hash = DigestOf(summary.statistics.passed, hash);
  hash = DigestOf(summary.statistics.stopped, hash);
  return DigestOf(summary.statistics.mean_color, hash);
}

}  // namespace semfoam
