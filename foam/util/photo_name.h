// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace semfoam {

// Returns whether a photo's name, such as "a/b.jpg", is a path that stays below the folder that it
// is relative to: not empty, not absolute, without "..". Names are read from files that may come
// from untrusted sources, and are used as paths to read (below the image folder) and to write
// (below output folders).
bool StaysBelowFolder(const std::string& name);

// Returns whether a name is valid UTF-8, as scene.foam and JSON files require.
bool IsUtf8(const std::string& name);

}  // namespace semfoam
