// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/hard_cases/hard_case.h"

namespace semfoam {

std::vector<HardCaseFamily> HardCaseFamilies() {
  return {{"sites", SitesCases()},
          {"frames", FramesCases()},
          {"rays", RaysCases()},
          {"values", ValuesCases()}};
}

}  // namespace semfoam
