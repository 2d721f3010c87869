// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "plugin/photo/photo.h"

#include <string>

namespace semfoam {

// Returns "640 x 480", for messages.
inline std::string SizeText(const PhotoSize& size) {
  return std::to_string(size.width) + " x " + std::to_string(size.height);
}

}  // namespace semfoam
