// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tools/cli/option_manager.h"

namespace semfoam {

// Adds --supersample, rays along each edge of a pixel (RenderCamera).
void AddSupersampleOption(OptionManager* options, int* supersample);

// Throws FieldError where it is out of range.
void CheckSupersample(int supersample);

}  // namespace semfoam
