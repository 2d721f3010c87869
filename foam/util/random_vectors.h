// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/util/random.h"

#include <Eigen/Core>

namespace semfoam {

// Draws three numbers of a stream in a defined order: z, y, x. The order of the arguments of a
// call, as in Vector3d(random->Normal(), ...), would be the compiler's choice; z first is the order
// of g++, with which the published figures were measured.

// Returns a uniform point in [0, 1)^3.
inline Eigen::Vector3d UniformVector(CounterRandom* random) {
  const double z = random->Uniform(), y = random->Uniform(), x = random->Uniform();
  return {x, y, z};
}

// Returns a vector of standard normal numbers.
inline Eigen::Vector3d NormalVector(CounterRandom* random) {
  const double z = random->Normal(), y = random->Normal(), x = random->Normal();
  return {x, y, z};
}

}  // namespace semfoam
