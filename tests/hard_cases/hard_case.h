// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/hard_cases/ray_checks.h"

// The hard cases: inputs on which a Voronoi ray tracer in floating point may loop, cancel, divide
// by zero or overflow, each with the outcome that it must have. They run in the tests and, by
// `semfoam self_test`, on a user's machine; so they know no GoogleTest and need no files.

namespace semfoam {

struct HardCase {
  std::string name;      // lower_case
  std::string expected;  // the stated outcome, one line
  // Runs the case.
  std::function<HardCaseResult(const CheckOptions& options)> run;
};

struct HardCaseFamily {
  std::string name;
  std::vector<HardCase> cases;
};

std::vector<HardCase> SitesCases();   // where sites lie
std::vector<HardCase> FramesCases();  // scales, offsets, cameras
std::vector<HardCase> RaysCases();    // how rays meet cells
std::vector<HardCase> ValuesCases();  // densities, depths, logits, moved sites

std::vector<HardCaseFamily> HardCaseFamilies();

}  // namespace semfoam
