// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace semfoam {

// Whether a photo's name, as "a/b.jpg", is a path of a file that stays below the folder that it is
// relative to: not empty, not absolute, without "..". Names come with data of others, and become
// paths that are read (below the image folder) and written (below output folders).
bool StaysBelowFolder(const std::string& name);

// Whether it is UTF-8, which alone can stand in scene.foam and in JSON files.
bool IsUtf8(const std::string& name);

}  // namespace semfoam
