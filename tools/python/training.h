// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

namespace semfoam::python {

// Adds train, segment, Progress, load_workspace and Workspace. Must be called after AddValues.
void AddTraining(pybind11::module_* module);

}  // namespace semfoam::python
