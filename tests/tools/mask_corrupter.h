// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/tools/program.h"

namespace semfoam {

// Runs the program mask_corrupter (commands/mask_corrupter.cc), which damages masks as trackers do.
inline Outcome RunMaskCorrupter(const std::vector<std::string>& arguments) {
  return RunProgram(SEMFOAM_MASK_CORRUPTER, arguments);
}

// The tabletop's masks with this share of the objects' views damaged.
inline void DamageTabletopMasks(const std::filesystem::path& masks, const std::string& share) {
  const Outcome outcome = RunMaskCorrupter({"--mask_path",
                                            (kTabletop / "object_mask").string(),
                                            "--output_path",
                                            masks.string(),
                                            "--share",
                                            share});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
}

}  // namespace semfoam
