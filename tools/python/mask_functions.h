// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

namespace semfoam::python {

// Adds the functions that make masks without a training.
void AddMaskFunctions(pybind11::module_* module);

}  // namespace semfoam::python
