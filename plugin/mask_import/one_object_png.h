// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/mask_import/pixel_runs.h"

#include <filesystem>

namespace semfoam {

// A PNG that is the mask of one thing: 0, and one other value.
struct OneObject {
  PhotoSize size;
  // The other value; 0 where there is none.
  uint32_t value = 0;
  PixelRuns runs;
};

// Reads such a PNG. Throws UserError, one sentence naming the file, where it is damaged or has more
// than one value besides 0.
OneObject ReadOneObject(const std::filesystem::path& file);

}  // namespace semfoam
