// SPDX-License-Identifier: GPL-3.0-or-later
#include "foam/model/sh_degree.h"

#include "foam/util/array_rows.h"

#include <algorithm>

#include <glog/logging.h>

namespace semfoam {

LargePageVector<float> ShOfDegree(const Foam& foam, int degree) {
  CHECK_GE(degree, 0);
  CHECK_LE(degree, 3);
  const size_t old_stride = foam.ShStride(), stride = 3 * NumShCoefficients(degree);
  return ResizeRows(foam.sh, old_stride, std::min(old_stride, stride), stride);
}

void ChangeShDegree(int degree, Foam* foam) {
  foam->sh = ShOfDegree(*foam, degree);
  foam->sh_degree = degree;
}

}  // namespace semfoam
