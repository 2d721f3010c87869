// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"

namespace semfoam {

// The SH coefficients [N][(degree + 1)^2][3] of a foam as another degree, 0 to 3, has them: bands
// that only one of the two has are zero or left out.
LargePageVector<float> ShOfDegree(const Foam& foam, int degree);

// Raises or lowers the SH degree of a foam, 0 to 3.
void ChangeShDegree(int degree, Foam* foam);

}  // namespace semfoam
