// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

namespace semfoam::python {

// Adds Foam and load. Must be called after AddValues.
void AddFoam(pybind11::module_* module);

}  // namespace semfoam::python
