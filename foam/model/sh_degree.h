// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "foam/model/foam.h"

namespace semfoam {

// Returns the SH coefficients of a foam converted to another degree, 0 to 3: [N][(degree +
// 1)^2][3]. Bands that the foam lacks are zero; bands above `degree` are left out.
LargePageVector<float> ShOfDegree(const Foam& foam, int degree);

// Raises or lowers the SH degree of a foam, 0 to 3.
void ChangeShDegree(int degree, Foam* foam);

}  // namespace semfoam
