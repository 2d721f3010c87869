// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/random.h"

#include <Eigen/Core>

namespace semfoam {

// Three numbers of a stream at once. In a call, as Vector3d(random->Normal(), ...) is one, it is
// the compiler that chooses which is drawn first, and not every time alike. Here it is z, as g++
// had it when the figures of the documents were measured.

// Uniform in [0, 1)^3.
inline Eigen::Vector3d UniformVector(CounterRandom* random) {
  const double z = random->Uniform(), y = random->Uniform(), x = random->Uniform();
  return {x, y, z};
}

// Standard normal.
inline Eigen::Vector3d NormalVector(CounterRandom* random) {
  const double z = random->Normal(), y = random->Normal(), x = random->Normal();
  return {x, y, z};
}

}  // namespace semfoam
